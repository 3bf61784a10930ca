"""Classes as trees: what the compilation cache of jax tells apart."""

import jax
import numpy as np
import pytest
from bodies import BODY

import jaxcontact as jc
from jaxcontact.simulate.indent import Indentation

pytestmark = pytest.mark.versions


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (jc.Load(1.0), jc.Approach(1.0)),
        (jc.Maxwell(1.0, 1.0, 0.3), jc.KelvinVoigt(1.0, 1.0, 0.3)),
        (jc.Grid((8, 8), (1.0, 1.0)), jc.Grid((8, 9), (1.0, 1.0))),
    ],
)
def test_structures_of_different_classes_and_shapes_differ(one, other):
    assert jax.tree.structure(one) != jax.tree.structure(other)
    assert jax.tree.structure(one) == jax.tree.structure(jax.tree.map(lambda a: a + 1.0, one))


def test_leaves_know_the_names_of_their_fields():
    paths = [jax.tree_util.keystr(path) for path, _ in jax.tree_util.tree_leaves_with_path(jc.Load(1.0))]
    assert paths == [".value"]


@pytest.mark.parametrize("kind", [tuple, list, np.float32])
def test_times_are_an_array_whatever_they_were_given_as(kind):
    times, grid = kind([0, 0.5]), jc.Grid.square(8, 600e-6)
    found = Indentation.of(BODY, jc.Sphere(9.5e-3), jc.Load(60), times, grid)
    assert found.times.dtype == found.control.value.dtype == np.float64 and found.times.tolist() == [0.0, 0.5]
