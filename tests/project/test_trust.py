"""No plausible use gives a wrong number without a word: what cannot be trusted says so."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import GLASS

import jaxcontact as jc
from jaxcontact.reference import hertz
from jaxcontact.results import storage

BALL, NOW = jc.Sphere(5e-3), np.zeros(1)
GRID = jc.Grid.square(24, 300e-6)


def run(body=GLASS, ball=BALL, load=20.0, times=NOW, grid=GRID, **options):
    return jc.indent(body, ball, jc.Load(load), times, grid=grid, **options)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:only")
def test_values_out_of_range_that_jit_and_vmap_hide_are_nan_with_a_status_of_their_own():
    """nu = 0.6 in one of three bodies, a negative load, times that go back: the others are as alone."""
    by_nu = lambda nu: run(jc.LayeredHalfSpace([], jc.Elastic(30e9, nu)))
    many = jax.jit(jax.vmap(by_nu))(jnp.array([0.25, 0.6, 0.5]))
    assert many.status[:, 0].tolist() == [jc.Status.FINE, jc.Status.OUT_OF_RANGE, jc.Status.FINE]
    assert not many.converged[1, 0]
    assert np.all(np.isnan(many.approach[1])) and np.all(np.isnan(many.pressure[1]))
    np.testing.assert_allclose(many.approach[0], run().approach, rtol=1e-7)
    two = np.array([0.0, 1.0])
    assert jax.jit(lambda t: run(times=t).status)(two[::-1]).tolist() == [7, 7]
    assert jax.jit(lambda W: run(load=W).status)(-1.0).tolist() == [7]
    assert np.isnan(
        jax.jit(lambda nu: jc.normal_response(jc.LayeredHalfSpace([], jc.Elastic(1e9, nu)), 1e3))(0.6)
    )
    steady = jax.jit(lambda v: jc.slide_steady(GLASS, BALL, jc.Load(20.0), velocity=v, grid=GRID).status)
    assert [int(steady(v)) for v in (1.0, np.inf)] == [0, 7]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_only_a_fine_step_is_converged_and_every_verdict_has_words():
    """A contact at the grid's edge, and one of a single cell, are solved to tolerance and still not trusted."""
    wide, narrow = run(grid=jc.Grid.square(24, 3e-3)), run(grid=jc.Grid.square(24, 100e-6))
    assert [int(h.status[0]) for h in (wide, narrow)] == [jc.Status.TOO_COARSE, jc.Status.AT_EDGE]
    assert not wide.converged[0] and not narrow.converged[0]
    assert float(narrow.error[0]) < 1e-8
    assert len({status.message for status in jc.Status}) == len(jc.Status)


@pytest.mark.slow
def test_statuses_are_stored_with_their_names(tmp_path):
    xarray = pytest.importorskip("xarray")
    jc.write_result(run(), tmp_path / "a.nc")
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as file:
        attributes = file.status.attrs
    assert attributes["flag_meanings"].split()[2] == "AT_EDGE"
    assert np.asarray(attributes["flag_values"]).tolist() == [int(status) for status in jc.Status]
    jc.write_result(run(), tmp_path / "a.npz")
    assert np.load(tmp_path / "a.npz")[storage.STATUS_NAMES].tolist() == [s.name for s in jc.Status]


@pytest.mark.slow
def test_a_function_that_saves_sees_one_step_in_si_by_name():
    """Peak pressure, load by its own integral, and the gap at the corner: as in the fields that are kept."""
    seen = lambda step: {
        "peak": step.pressure.max(),
        "load": step.pressure.sum() * GRID.cell_area,
        "corner": step.gap[0, 0],
        "depth": step.approach,
        "verdict": step.status,
    }
    saved, kept = run(save=seen).saved, run()
    a = (3 * 20.0 * 5e-3 * 0.75 / 30e9 / 8) ** (1 / 3)
    assert float(saved["peak"][0]) == pytest.approx(3 * 20.0 / (2 * np.pi * a**2), rel=2e-2)
    assert float(saved["load"][0]) == pytest.approx(20.0, rel=1e-12)
    np.testing.assert_allclose(saved["corner"], kept.gap[:, 0, 0], rtol=1e-12)
    assert float(saved["depth"][0]) == pytest.approx(hertz.approach(20.0, 5e-3, 0.75 / 30e9), rel=1e-2)
    assert saved["verdict"].tolist() == [0]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:only")
def test_the_lateral_force_of_a_steady_indenter_has_a_slope_at_rest():
    """By the velocity, against a difference; the force against the motion has a kink there."""
    rubber = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=2.0, G2=1.0, eta2=1.0))
    grid = jc.Grid.square(16, 3.0)
    f = lambda v: jc.slide_steady(
        rubber, jc.Sphere(10.0), jc.Load(0.05), velocity=v, grid=grid, tolerance=1e-11
    ).lateral_force[0]
    slope, h = float(jax.grad(f)(0.0)), 1e-3
    assert slope == pytest.approx(float(f(h) - f(-h)) / (2 * h), rel=1e-3)
    assert slope < 0.0


TOO_SOFT = jc.LayeredHalfSpace([], jc.Elastic(1e-309, 0.3))  # J is not finite


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("verb", ["indent", "slide", "slide_steady", "shear", "roll_steady"])
def test_a_response_that_is_not_finite_has_a_status_of_its_own_in_every_verb(verb):
    given, times = (TOO_SOFT, BALL, jc.Load(20.0)), np.array([0.0])
    result = {
        "indent": lambda: jc.indent(*given, times, grid=GRID),
        "slide": lambda: jc.slide(*given, times, velocity=1.0, grid=GRID),
        "slide_steady": lambda: jc.slide_steady(*given, velocity=1.0, grid=GRID),
        "shear": lambda: jc.shear(
            *given, jc.TangentialLoad((1.0, 0.0)), times, friction=0.3, grid=GRID, coupled=False
        ),
        "roll_steady": lambda: jc.roll_steady(
            *given, velocity=1.0, creepage=(1e-3, 0.0), friction=0.3, grid=GRID, coupled=False
        ),
    }[verb]()
    assert np.atleast_1d(result.status).tolist() == [jc.Status.NOT_FINITE]
    assert "not finite" in jc.Status.NOT_FINITE.message


@pytest.mark.parametrize(
    ("separation", "horizon", "status"), [(2e-2, np.inf, 11), (1e-3, 0.5, 11), (1e-3, 2.0, 0)]
)
def test_a_response_known_to_be_off_by_more_than_a_hundredth_is_not_fine(separation, horizon, status):
    from jaxcontact.operators.kernels import Errors
    from jaxcontact.simulate.run import with_error_statuses

    errors = Errors(np.asarray(separation), np.asarray(1e-6), np.asarray(horizon))
    found = with_error_statuses(np.array([0, 3, 1, 6]), np.ones(4), errors)
    assert np.asarray(found).tolist() == [status or 0, status or 3, status or 1, 6]
