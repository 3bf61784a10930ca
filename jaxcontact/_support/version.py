"""The version of the package, and its citation beside that of the paper whose model it solves."""

__version__ = "0.2.0"

TITLE = "jaxcontact: differentiable time-dependent contact with a viscoelastic layered half-space"
PAPER = """@article{wang2025zddp,
  author  = {Wang and Ghanbarzadeh and Xu and Liu and de Boer},
  title   = {Time-Dependent Contact Behaviour of {ZDDP}-Derived Tribofilms: A Viscoelastic Layered Model Approach},
  journal = {Tribology Letters},
  year    = {2025},
  doi     = {10.1007/s11249-025-01990-5}
}"""


def cite() -> str:
    """Return the citations of this version of the package and of the paper whose model it solves.

    Returns:
        Two BibTeX entries, as text.

    Example:
        >>> print(jc.cite().splitlines()[0])
        @software{jaxcontact,
    """
    software = f"""@software{{jaxcontact,
  author  = {{{{The jaxcontact developers}}}},
  title   = {{{{{TITLE}}}}},
  version = {{{__version__}}},
  year    = {{2026}}
}}"""
    return f"{software}\n\n{PAPER}"
