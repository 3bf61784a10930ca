"""The README's Python runs as written."""

import re
import warnings
from pathlib import Path

README = (Path(__file__).parents[1] / "README.md").read_text()


def test_python_blocks_of_the_readme_run(capsys):
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len(blocks) >= 2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec("\n".join(blocks), {})
    assert "Burgers(" in capsys.readouterr().out
