"""Case files of layers on a rigid base, bonded and loose."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from jaxcontact.results.figures import contact_section
from jaxcontact.shell.case_file import CaseError, read_case

GEL = """# A ball on a gel on glass
[layer]
material = "elastic"
E = 1e3
nu = 0.5
thickness = "10 um"
bonded = false

[substrate]
material = "rigid"

[indenter]
shape = "sphere"
radius = 1e-3

[control]
approach = "0.1 um"

[times]
values = [0.0]

[grid]
n = 32
width = 40e-6
"""


@pytest.mark.slow
def test_a_loose_gel_on_a_rigid_base(tmp_path):
    """The body of the file, its run, the name of the base in a section, and what is refused."""
    path = tmp_path / "gel.toml"
    path.write_text(GEL)
    case = read_case(path)
    assert case.body.substrate is None and case.body.layers[0].bonded is False
    result = case.run()
    expected = 1e3 * 1e-15 / (0.75 * 1e-3) * 3.3394  # F = E h^3/((1 - nu^2) R) f, f(1) of a loose layer
    np.testing.assert_allclose(result.load[-1], expected, rtol=5e-3)
    ax = contact_section(plt.figure().gca(), result, case.body)
    texts = [text.get_text() for text in ax.texts]
    plt.close("all")
    assert any("loose" in text for text in texts) and any("rigid base" in text for text in texts)
    path.write_text(GEL.replace("bonded = false", "bonded = 2"))
    with pytest.raises(CaseError, match=r"layer.bonded: found 2.*true or false"):
        read_case(path)
    path.write_text(GEL.replace('material = "elastic"', 'material = "rigid"'))
    with pytest.raises(CaseError, match=r'layer.material: found "rigid"'):
        read_case(path)
