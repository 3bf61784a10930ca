"""The integrals of the exponential against 40-digit values."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

from jaxcontact._support.exponential import mean_decay, phi1, ramps

GOOD = 3e-14
REAL = np.concatenate([[0.0], np.geomspace(1e-18, 1e3, 64), [0.0999, 0.1, 0.1001]])
TURN = np.exp(1j * np.linspace(-np.pi / 2, np.pi / 2, 9))
COMPLEX = (REAL[1:, None] * TURN).ravel()


def exact(z):
    """phi1, exp(-z), int s exp(-z s), int (1 - s) exp(-z s) over 0 <= s <= 1."""
    with mp.workdps(60):
        z = mp.mpmathify(complex(z))
        if z == 0:
            return 1.0, 1.0, 0.5, 0.5
        decay = mp.exp(-z)
        mean = (1 - decay) / z
        return tuple(complex(v) for v in (mean, decay, (mean - decay) / z, (1 - mean) / z))


@pytest.mark.parametrize("z", [REAL, COMPLEX], ids=["real", "complex"])
def test_integrals_of_the_exponential(z):
    found = [phi1(jnp.asarray(z)), *ramps(jnp.asarray(z))]
    for ours, theirs in zip(found, np.array([exact(v) for v in z]).T, strict=True):
        size = np.abs(theirs) + (np.abs(theirs) < 1e-300)
        np.testing.assert_array_less(np.abs(np.asarray(ours) - theirs) / size, GOOD)


def test_their_slopes_are_right_at_zero_and_on_both_sides_of_the_change_of_form():
    """d/dz of int_0^1 w(s) exp(-z s) ds = -int_0^1 s w(s) exp(-z s) ds, in 40 digits."""
    weights = (lambda s: 1, lambda s: s, lambda s: 1 - s)
    found = jax.jacfwd(lambda z: jnp.stack([phi1(z), *ramps(z)[1:]]))
    for z in (0.0, 1e-12, 1e-3, 0.0999, 0.1, 0.3, 1.0, 30.0):
        with mp.workdps(40):
            exact = [float(-mp.quad(lambda s, w=w, z=z: s * w(s) * mp.exp(-z * s), [0, 1])) for w in weights]
        np.testing.assert_allclose(found(z), exact, rtol=1e-12)
    assert jax.grad(lambda z: ramps(z)[0])(0.0) == -1.0


def test_mean_decay_over_an_interval_and_at_an_instant():
    assert float(mean_decay(2.0, 0.3, 0.3)) == pytest.approx(np.exp(-0.6), rel=1e-15)
    assert float(mean_decay(2.0, 0.0, 3.0)) == pytest.approx((1 - np.exp(-6.0)) / 6.0, rel=1e-15)
