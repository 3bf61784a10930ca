"""The memory of a creeping surface: the displacement that earlier pressure has left, in a step of the march.

``RecursiveMemory`` is that of ``indent``: a few fields with exact exponential steps, equivalent to the hereditary integral.
``BothSurfaces`` joins those of body and indenter, ``TractionMemory`` remembers friction as well (``shear``), and
``MovingMemory`` a body that moves past the contact (``slide``). ``GrowingMemory`` and ``VaryingMemory`` are for films whose
thickness changes, ``DirectMemory`` superposes all earlier steps, as the paper does.

A memory keeps fields of its own kind (arrays over the grid, spectra, increments: a pytree) and has four methods.
A step of the march is

    operator, earlier, fields, *_ = memory.predict(fields, traction, step)         before the new traction is known
    traction = contact(operator, profile + earlier, target)                operator(t) + earlier: the displacement
    fields = memory.update(fields, traction, step)                         the new traction is remembered
    numbers = memory.observe(fields, traction, step)                       further numbers of the result

``traction`` is the pressure (nx, ny) or, with friction, q_x, q_y and p, (3, nx, ny); ``earlier`` is the displacement in
these directions. ``step`` is the input of the memory: a time step, with what moves or changes in it, or the row of a table.
"""

import abc
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.grid import Grid
from jaxcontact.contact.adhesive import Drag
from jaxcontact.history.time_loop import Delayed
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.coupled import TractionOperator
from jaxcontact.operators.kernels import (
    FilmStrain,
    FrictionKernels,
    ImageKernels,
    Kernels,
    TractionKernels,
    VaryingFilmStrain,
    build,
    deepest_strain,
    image_weights,
)
from jaxcontact.operators.operator import Operator
from jaxcontact.response.stack import film_creep, top_layer


class Prediction(NamedTuple):
    """The response of the body in the next step, before its traction is known.

    operator: displacement of the new traction; earlier: displacement left by earlier traction, of the shape of the traction;
    fields: of the memory, input of ``update``; raised: how far growth has raised the surface since the start, (nx, ny) or 0;
    drag: the friction of a sliding contact with adhesion, or None.
    """

    operator: Operator | TractionOperator
    earlier: Array
    fields: Any
    raised: Array | float = 0.0
    drag: Drag | None = None


class Memory(abc.ABC):
    """The interface of a memory (head of the module); all quantities are scaled."""

    @property
    def inherits(self) -> bool:
        """True if a step depends on earlier ones (static); false only for an elastic body."""
        return True

    @abc.abstractmethod
    def start(self, shape: tuple[int, int]) -> Any:
        """Return the fields before the first step, on a grid of this shape."""

    @abc.abstractmethod
    def predict(self, fields: Any, traction: Array, step: Any) -> Prediction:
        """Return the prediction for the next step; traction: of the previous one."""

    @abc.abstractmethod
    def update(self, fields: Any, traction: Array, step: Any) -> Any:
        """Return the fields after the step, with its new traction."""

    def of_body(self, fields: Any) -> Any:
        """Return the part of the fields that belongs to the body."""
        return fields

    def stored_energy(self, fields: Any, pressure: Array) -> Array:
        """Return the elastic energy that the body stores under a pressure, (), nan where it is not known; scaled."""
        return jnp.asarray(jnp.nan)

    @property
    @abc.abstractmethod
    def delayed_rates(self) -> Array:
        """The rates lambda_k of ``works`` [1/s], (K,)."""

    @abc.abstractmethod
    def works(self, fields: Any, pressure: Array) -> Array:
        """Return <p, C_0 p> and <p, lambda_k C_k p> [1/s] for a pressure (nx, ny), (1 + K,), times any common factor.

        fields: after a step. The ratios are the shares of ``delayed``.
        """

    def delayed(self, fields: Any, pressure: Array) -> Delayed:
        """Return the delayed compliance under a pressure (nx, ny), from the fields after a step."""
        at_once, *_ = works = self.works(fields, pressure)
        some = at_once > 0.0
        shares = works[1:] / jnp.where(some, at_once, 1.0)
        return Delayed(self.delayed_rates, jnp.where(some, jnp.maximum(shares, 0.0), 0.0))

    @abc.abstractmethod
    def observe(
        self, fields: Any, traction: Array, step: Any, other: Array | None = None
    ) -> dict[str, Array]:
        """Return scaled numbers by the names of a result, ``film_strain`` among them, from the fields after the step.

        other: where the indenter creeps (``BothSurfaces``), the displacement of its surface under the pressure and, in
        sliding with friction, that under the traction, (1 or 2, nx, ny); otherwise None.
        """


# The hereditary integral by internal variables, at a cost for each step that does not grow with time.
#
#     u(t) = C_0 * p + sum_k lambda_k C_k * eta_k,      eta_k' = p - lambda_k eta_k,      eta_k = 0 at first.
#
# For a pressure linear over a step dt the update is exact: with z = lambda dt, and
# psi and phi2 the integrals of the exponential (``_support.exponential``),
#
#     eta(t + dt) = exp(-z) eta + dt psi(z) p(t) + dt phi2(z) p(t + dt).
#
# lambda = 0 (steady-state viscous flow) gives psi = phi2 = 1/2. A step of zero length keeps the fields, so that the response
# to a jump of the load is the instantaneous kernel C_0. The error is of second order in dt, and every dt is stable.


class BeforeStep(NamedTuple):
    """eta (K, nx, ny) and the pressure (nx, ny) before a step. ``update`` changes eta, once for each step, so that these
    large arrays are read and written once."""

    eta: Array
    pressure: Array


@pytree
class RecursiveMemory(Memory):
    """Exact exponential recursion over the rates of the kernels; fields: eta (K, nx, ny); step: dt [s]."""

    kernels: Kernels

    @property
    def inherits(self) -> bool:
        """True if there is any rate; without one the displacement depends on the present pressure alone."""
        return self.kernels.rates.shape[0] > 0

    def start(self, shape: tuple[int, int]) -> Array:
        return jnp.zeros((self.kernels.rates.shape[0], *shape))

    def predict(self, eta: Array, pressure: Array, dt: Array) -> Prediction:
        # u(t + dt) = [C_0 + sum_k dt phi2(z_k) lambda_k C_k] * p(t + dt)                         the operator
        #             + sum_k lambda_k C_k * (exp(-z_k) eta_k(t) + dt psi(z_k) p(t))               earlier
        # with lambda_k C_k = sum_m mix[m, k] S_m: fields are mixed by the rates first, and then meet M kernels, not K.
        k = self.kernels
        decay, old, new = ramps(k.rates * dt)  # exp(-z), psi(z), phi2(z)
        count = len(k.mix) if len(eta) else 0  # an elastic body has no history
        mix = k.mix[:count]  # of matrices: quicker to differentiate
        mixed = (mix * decay) @ eta.reshape(len(eta), pressure.size)
        mixed = mixed.reshape(count, *pressure.shape) + jnp.tensordot(mix @ (dt * old), pressure, 0)
        earlier = k.family.superposed(mixed)
        return Prediction(k.family.combined([1.0, *(k.mix @ (dt * new))]), earlier, BeforeStep(eta, pressure))

    def update(self, before: BeforeStep, pressure: Array, dt: Array) -> Array:
        decay, old, new = ramps(self.kernels.rates * dt)
        added = jnp.tensordot(dt * old, before.pressure, 0) + jnp.tensordot(dt * new, pressure, 0)
        return decay[:, None, None] * before.eta + added

    def stored_energy(self, eta: Array, pressure: Array) -> Array:
        """Return 1/2 <p, C_0 p> + 1/2 sum_k lambda_k <eta_k, lambda_k C_k eta_k>, the energy of the springs
        (*Energy* below), ().
        """
        k = self.kernels
        work = lambda weights, field: jnp.sum(field * k.family.combined(list(weights))(field))
        at_once = work(jnp.zeros(1 + len(k.mix)).at[0].set(1.0), pressure)
        springs = jax.vmap(lambda mix, eta: work([0.0, *mix], eta))(k.mix.T, eta)
        return 0.5 * at_once + 0.5 * jnp.sum(k.rates * springs)

    @property
    def delayed_rates(self) -> Array:
        return self.kernels.rates

    def works(self, eta: Array, pressure: Array) -> Array:
        return self.kernels.works(pressure)

    def steady(self, pressure: Array) -> Array:
        """Return the fields after a constant pressure of infinite duration, p/lambda_k, with zero for steady-state
        viscous flow."""
        rates = self.kernels.rates[:, None, None]
        return jnp.where(rates > 0.0, pressure / jnp.where(rates > 0.0, rates, 1.0), 0.0)

    def steady_operator(self) -> Operator:
        """Return the operator of a constant pressure of infinite duration: the relaxed compliance, without viscous flow."""
        return self.kernels.family.combined(
            [1.0, *(self.kernels.mix @ self.steady(jnp.ones((1, 1)))[:, 0, 0])]
        )

    def displacement(self, eta: Array, pressure: Array) -> Array:
        """Return the displacement, (nx, ny), from the fields after a step and its pressure."""
        k = self.kernels
        return k.family.superposed(jnp.concatenate([pressure[None], jnp.tensordot(k.mix, eta, 1)]))

    def observe(self, eta: Array, pressure: Array, dt: Array, other: Array | None = None) -> dict[str, Array]:
        film = self.kernels.film_strain
        if film is None:
            return {"film_strain": jnp.zeros(())}
        return {"film_strain": film.strain(pressure, eta)}


# The memories of both surfaces of a contact.
#
# Under one pressure the displacements of body and indenter add, and each surface remembers the pressure at its own rates
# and with its own velocity: the body may move past the contact, while the surface of an indenter that slides is at rest in
# it. So the operator of a step is the sum of those of the surfaces, and what earlier pressure has left is the sum of theirs.
# This holds for the traction of friction in sliding as well: the memory of the indenter is then one whose move is zero.


@pytree
class BothSurfaces(Memory):
    """The memories of body and indenter, in this order; the surface of the indenter is at rest in its frame.

    Fields: a tuple of the fields of each memory; step: the input of the body's memory. The indenter's memory takes the time
    step from it, in sliding with friction all but the move.
    """

    memories: tuple[Any, ...]

    @property
    def inherits(self) -> bool:
        return any(memory.inherits for memory in self.memories)

    def _each(self, fields: tuple[Any, ...], step: Any) -> list[tuple[Any, Any, Any]]:
        """Return memory, fields and step of each surface."""
        at_rest = getattr(step, "dt", step)
        here = lambda memory: step.standing() if isinstance(memory, MovingMemory) else at_rest
        steps = [step, *(here(memory) for memory in self.memories[1:])]
        return list(zip(self.memories, fields, steps, strict=True))

    def start(self, shape: tuple[int, int]) -> tuple[Any, ...]:
        return tuple(memory.start(shape) for memory in self.memories)

    def predict(self, fields: tuple[Any, ...], traction: Array, step: Any) -> Prediction:
        found = [memory.predict(own, traction, at) for memory, own, at in self._each(fields, step)]
        operator, earlier, _, raised, drag = found[0]
        for more in found[1:]:
            operator, earlier = operator.plus(more.operator), earlier + more.earlier
            if drag is not None and more.drag is not None:
                drag = replace(drag, displacement=drag.displacement.plus(more.drag.displacement))
        return Prediction(operator, earlier, tuple(each.fields for each in found), raised, drag)

    def update(self, fields: tuple[Any, ...], traction: Array, step: Any) -> tuple[Any, ...]:
        return tuple(memory.update(own, traction, at) for memory, own, at in self._each(fields, step))

    def stored_energy(self, fields: tuple[Any, ...], pressure: Array) -> Array:
        each = zip(self.memories, fields, strict=True)
        return sum((memory.stored_energy(own, pressure) for memory, own in each), start=jnp.zeros(()))

    @property
    def delayed_rates(self) -> Array:
        return jnp.concatenate([memory.delayed_rates for memory in self.memories])

    def works(self, fields: tuple[Any, ...], pressure: Array) -> Array:
        found = [memory.works(own, pressure) for memory, own in zip(self.memories, fields, strict=True)]
        at_once = sum((each[:1] for each in found), start=jnp.zeros(1))
        return jnp.concatenate([at_once, *(each[1:] for each in found)])

    def of_body(self, fields: tuple[Any, ...]) -> Any:
        return fields[0]

    def observe(
        self, fields: tuple[Any, ...], traction: Array, step: Any, other: Array | None = None
    ) -> dict[str, Array]:
        """Return the observables of the body, and displacement (nx, ny) and film strain of the indenter."""
        (body, own, at), (memory, of_indenter, its) = self._each(fields, step)
        parts = memory.displacement(of_indenter, traction)[None]
        if isinstance(memory, MovingMemory):
            by_traction = memory.by_traction(of_indenter, its, traction.shape)
            parts = parts if by_traction is None else jnp.stack([parts[0], by_traction])
        strain = memory.observe(of_indenter, traction, its)["film_strain"]
        shown = {"indenter_displacement": jnp.sum(parts, 0), "indenter_film_strain": strain}
        return body.observe(own, traction, at, parts) | shown


def with_indenter(memory: Memory, kernels: Kernels | TractionKernels) -> Memory:
    """Return the memory of a contact: that of the body, joined to one of the indenter where ``kernels.indenter`` is
    given."""
    own = kernels.indenter
    if own is None:
        return memory
    return BothSurfaces((memory, RecursiveMemory(own) if isinstance(own, Kernels) else TractionMemory(own)))


# The memory of tractions: the recursion of ``RecursiveMemory`` in three directions.
#
#     u = C_0 * t + sum_k lambda_k C_k * eta_k,      eta_k' = t - lambda_k eta_k,      t = (q_x, q_y, p).
#
# The normal displacement under the pressure keeps the rates, fields and kernels that it has in ``indent``; all that
# the tangential kernels touch has rates and fields of its own.


class TractionFields(NamedTuple):
    """pressure: the fields of ``RecursiveMemory``, (K, nx, ny); traction: eta under (q_x, q_y, p), (K', 3, nx, ny)."""

    pressure: Array
    traction: Array


@pytree
class TractionMemory(Memory):
    """Exact exponential recursion for tractions (3, nx, ny) of q_x, q_y and p; fields: ``TractionFields``; step: dt [s]."""

    kernels: TractionKernels

    @property
    def normal(self) -> RecursiveMemory:
        """The memory of the pressure alone."""
        return RecursiveMemory(self.kernels.normal)

    def displacement(self, fields: TractionFields, traction: Array) -> Array:
        """Return the normal displacement, (nx, ny), from the fields after a step and its traction."""
        k = self.kernels
        at_once = k.family.combined(jnp.zeros(1 + len(k.mix)).at[0].set(1.0))
        # only the coupling of this operator is used, so that its normal part may be any
        operator = TractionOperator(self.normal.steady_operator(), at_once)
        by_traction = operator.normal_from_tangential(traction[:2])
        by_traction = by_traction + k.family.normal_from_earlier(jnp.tensordot(k.mix, fields.traction, 1))
        return self.normal.displacement(fields.pressure, traction[2]) + by_traction

    def start(self, shape: tuple[int, int]) -> TractionFields:
        return TractionFields(self.normal.start(shape), jnp.zeros((self.kernels.rates.size, 3, *shape)))

    def predict(self, fields: TractionFields, traction: Array, dt: Array) -> Prediction:
        # as in ``RecursiveMemory.predict``, with t = (q_x, q_y, p): exp(-z_k) eta_k + dt psi(z_k) t is what is left of the
        # fields, and dt phi2(z_k) goes into the operator; u_z under p has its own rates and is that of the normal memory
        k = self.kernels
        pressed = self.normal.predict(fields.pressure, traction[2], dt)
        decay, old, new = ramps(k.rates * dt)
        eta = decay[:, None, None, None] * fields.traction + jnp.tensordot(dt * old, traction, 0)
        mixed = jnp.tensordot(k.mix, eta, 1)
        operator = k.family.combined(jnp.append(1.0, k.mix @ (dt * new)))
        normal = pressed.earlier + k.family.normal_from_earlier(mixed)
        earlier = jnp.concatenate([k.family.tangential_from_earlier(mixed), normal[None]])
        return Prediction(
            TractionOperator(pressed.operator, operator), earlier, TractionFields(pressed.fields, eta)
        )

    def update(self, fields: TractionFields, traction: Array, dt: Array) -> TractionFields:
        new = dt * ramps(self.kernels.rates * dt)[2]
        pressure = self.normal.update(fields.pressure, traction[2], dt)
        return TractionFields(pressure, fields.traction + jnp.tensordot(new, traction, 0))

    @property
    def delayed_rates(self) -> Array:
        return self.normal.delayed_rates

    def works(self, fields: TractionFields, pressure: Array) -> Array:
        return self.normal.works(fields.pressure, pressure)

    def observe(
        self, fields: TractionFields, traction: Array, dt: Array, other: Array | None = None
    ) -> dict[str, Array]:
        return self.normal.observe(fields.pressure, traction[2], dt)


# Memory that moves past the indenter.
#
# Fields are kept in the indenter's frame. Over a body that the indenter crosses with velocity v they obey
#
#     u = C_0 * p + sum_k lambda_k C_k * eta_k,      d eta_k/dt - v . grad eta_k = p - lambda_k eta_k,
#
# so that the Fourier mode k of eta_k decays at the complex rate lambda_k - i k . v. For a pressure linear
# over a step dt the update is exact: with z = (lambda - i k . v) dt and the integrals of the exponential,
#
#     eta(t + dt) = exp(-z) eta + dt psi(z) p(t) + dt phi2(z) p(t + dt),
#
# for any step, sub-pixel or many pixels, and without any error where p is steady. (Theory: the exponential
# integrator of ``RecursiveMemory`` along the characteristics, in Fourier space.)
#
# The modes are those of the zero-padded grid. In the padding an absorbing layer reduces the fields in proportion to the
# distance that they move, so that nothing wraps around. The absorbed part is summed, and gives the bound on the truncation
# error. Along a periodic axis there is no padding, and what leaves on one side enters on the other: the indenter is one of a
# periodic row.
#
# With friction the traction mu p e, e the unit vector of the motion, is remembered as p is, by the components of e
# and at rates of its own.


ABSORPTION = 40.0  # the absorbing layer lets exp(-40) through
ABSORB_AFTER = 1 / 32  # distance over the padded length after which the absorbing layer is applied
NEVER = 1e9  # distance that stands for no loss of history [cells]


class Way(NamedTuple):
    """Displacement of the indenter along x and y; y is None when it moves along x only."""

    x: Array
    y: Array | None


class Motion(NamedTuple):
    """One step: dt [s], the move of the indenter [cells along x], and the unit vector of the velocity at its end, (2,).

    aside: how far in the middle of the step the indenter is off the way of its mean velocity; None where the
    velocity does not change. sheared: for ``update``, the traction at its end where it does not follow from the pressure,
    (nx, ny), else None.
    """

    dt: Array
    move: Way
    direction: Array
    aside: Way | None = None
    sheared: Array | None = None

    def standing(self) -> "Motion":
        """Return the step of a surface that is at rest in the frame of the fields, under the same tractions."""
        return self._replace(move=Way(jnp.zeros(()), None), aside=None)


def distance(way: Array) -> Array:
    """Return the size of a component of a way; at zero its derivative is zero, the mean of those on either side."""
    return jnp.where(way == 0.0, 0.0, jnp.abs(way))


def phase_and_loss(shape: tuple[int, int], move: Way, ratio: Array | float) -> tuple[Array, Array]:
    """Return the phase k . move of each Fourier mode in a move, and the exponent of the loss of modes without a direction.

    Both are (1, mx), or (my/2 + 1, mx) where the move has a y. shape: (mx, my), of the padded grid; ratio: dy/dx. The
    highest mode of an even grid stands for both signs of its wavenumber, so that no move of it can be represented: its
    phase is zero, and it decays by as much as its phase would have changed.
    """
    mx, my = shape
    m = 2.0 * jnp.pi * jnp.fft.fftfreq(mx)
    highest = (jnp.arange(mx) == mx // 2) & (mx % 2 == 0)
    phase = jnp.where(highest, 0.0, m) * move.x
    loss = jnp.where(highest, jnp.abs(m), 0.0) * distance(move.x)
    if move.y is None:
        return phase[None], loss[None]
    n = 2.0 * jnp.pi * jnp.fft.rfftfreq(my) / ratio
    highest = (jnp.arange(n.size) == my // 2) & (my % 2 == 0)
    phase = phase + (jnp.where(highest, 0.0, n) * move.y)[:, None]
    return phase, loss + (jnp.where(highest, jnp.abs(n), 0.0) * distance(move.y))[:, None]


def step_weights(rates: Array, motion: Motion, shape: tuple[int, int], ratio: Array) -> tuple[Array, ...]:
    """Return the weights of eta, p(t) and p(t + dt) in the update of ``MovingMemory``, each (K, 1 or my/2 + 1, mx)."""
    phase, loss = phase_and_loss(shape, motion.move, ratio)
    decay, old, new = ramps((rates * motion.dt)[:, None, None] + jax.lax.complex(loss, -phase))
    return decay, motion.dt * old, motion.dt * new


class Trail(NamedTuple):
    """The track of the contact towards the sides -x, +x; -y, +y of the window, (2, 2) each [cells along x].

    reach: distance from the indenter to the end of the track; inside: distance from the side, inwards, of the nearest place
    whose history was lost through that side, -``NEVER`` if none was.
    """

    reach: Array
    inside: Array


class MovingFields(NamedTuple):
    """State of a moving memory.

    eta: spectra, (K, my/2 + 1, mx); pressure: spectrum of the last pressure; sheared: spectrum of
    ``FrictionKernels.sheared`` of it, None where that is the pressure; moved: distance since the last absorption over the
    padded lengths, (2,); lost: sum of the absorbed eta, with its decay since then, (K,); trail: the place where it was;
    truncation_bound: bound on the displacement in contact that the lost history would still cause, (); overlaps: whether it
    may be under the contact, ().
    """

    eta: Array
    pressure: Array
    sheared: Array | None
    moved: Array
    lost: Array
    trail: Trail
    truncation_bound: Array
    overlaps: Array


@pytree
class MovingMemory(Memory):
    """The memory of a body that moves past the contact. Fields: ``MovingFields``; step: a ``Motion``.

    spectra: C_0 and lambda_k C_k, (K + 1, my/2 + 1, mx), first the rates of the response to pressure, then those of the
    response to traction; circulants: of the response to pressure alone; rates [1/s], (K,); sources: the parts of p, p e_x
    and p e_y that drive each eta_k, (K, 3); friction: its kernels, and traction_at_once: their C_0 along x and y, (2, my/2 +
    1, mx), both None without friction; shear: with adhesion the coefficient of friction and the shear strength, whose
    traction is then a ``Drag``, while ``friction`` has a coefficient of one; tails: lambda_k C_k [1/s] at offsets along x,
    (K, nx); ratio: dy/dx, ().
    """

    spectra: Array
    circulants: Array
    rates: Array
    sources: Array
    traction_at_once: Array | None
    friction: FrictionKernels | None
    tails: Array
    ratio: Array
    kernels: Kernels
    observer: "Observer"
    shear: tuple[Array, Array] | None = None

    @property
    def inherits(self) -> bool:
        """True if there is any rate, as in ``RecursiveMemory``."""
        return self.rates.shape[0] > 0

    @property
    def _periodic(self) -> spectral.Periodic:
        return self.kernels.family.periodic

    def _padded(self, shape: tuple[int, ...]) -> tuple[int, int]:
        return spectral.padded_shape(shape, self._periodic)

    def start(self, shape: tuple[int, int]) -> MovingFields:
        mx, my = self._padded(shape)
        zero = jnp.zeros((my // 2 + 1, mx), complex)
        return MovingFields(
            jnp.broadcast_to(zero, (self.rates.size, *zero.shape)),
            zero,
            zero if self._varies else None,
            jnp.zeros(2),
            jnp.zeros(self.rates.size),
            Trail(jnp.zeros((2, 2)), jnp.full((2, 2), -NEVER)),
            jnp.zeros(()),
            jnp.zeros((), bool),
        )

    def predict(self, fields: MovingFields, pressure: Array, motion: Motion) -> Prediction:
        # 1. The history moves with the body, decays, and takes in the pressure at the beginning of the step (both in the
        # weights of a spectrum); u of the earlier pressure is sum_k lambda_k C_k eta_k.
        shape = pressure.shape
        fields = absorb(fields, motion, self.ratio, shape, self._periodic)
        decay, old, new = step_weights(self.rates, motion, self._padded(shape), self.ratio)
        eta = decay * fields.eta + old * self._source(motion, fields)
        earlier = spectral.inverse(jnp.sum(self.spectra[1:] * eta, 0), shape, self._periodic)

        # 2. The operator of the pressure at the end of the step: C_0 + sum_k w_k lambda_k C_k, and that of the traction, as
        # a part of it or, with adhesion, as a drag.
        on_grid = step_weights(self.kernels.rates, motion, shape, self.ratio)[2]
        now = lambda parts, weights: parts[0] + jnp.sum(parts[1:] * weights, 0)
        of_pressure, of_traction = self._shares(motion)
        spectrum, circulant = now(self.spectra, new * of_pressure), now(self.circulants, on_grid)
        operator, drag = Operator(spectrum[None], circulant, periodic=self._periodic), None
        if self.traction_at_once is not None and self.friction is not None:
            kernel = jnp.tensordot(motion.direction, self.traction_at_once, 1)
            kernel = kernel + jnp.sum(self.spectra[1:] * (new * of_traction), 0)
            if self.shear is None:
                operator = self.friction.added_to(operator, kernel)
            else:
                drag = Drag(replace(operator, spectra=kernel[None]), *self.shear)

        # 3. The trail from the indenter's new place.
        lost = fields.lost * jnp.exp(-self.rates * motion.dt)
        move, trail = motion.move, fields.trail
        moved = jnp.stack([move.x, jnp.zeros_like(move.x) if move.y is None else move.y])
        away = moved[:, None] * jnp.array([1.0, -1.0])
        trail = Trail(jnp.maximum(trail.reach + away, 0.0), trail.inside - away)
        fields = fields._replace(eta=eta, lost=lost, trail=trail)
        return Prediction(operator, earlier, fields, drag=drag)

    def update(self, fields: MovingFields, pressure: Array, motion: Motion) -> MovingFields:
        # the spectra of pressure and traction at the end of the step, which the history takes in
        new = step_weights(self.rates, motion, self._padded(pressure.shape), self.ratio)[2]
        fields = fields._replace(pressure=spectral.transform(pressure, self._periodic))
        if self.friction is not None and self._varies:
            sheared = self.friction.sheared(pressure) if motion.sheared is None else motion.sheared
            sheared = spectral.transform(sheared, self._periodic)
            fields = fields._replace(sheared=sheared)
        # history is lost where the end of the track, with the extent of the contact, is beyond the side of the window
        clear, trail = clearance(pressure, self.ratio), fields.trail
        trail = trail._replace(
            inside=jnp.where(trail.reach > clear, jnp.maximum(trail.inside, 0.0), trail.inside)
        )
        truncation_bound, overlaps = truncation_of(self.tails, fields.lost, clear - trail.inside)
        return fields._replace(
            eta=fields.eta + new * self._source(motion, fields),
            trail=trail,
            truncation_bound=truncation_bound,
            overlaps=overlaps,
        )

    @property
    def _varies(self) -> bool:
        """True if the coefficient of friction is a field, so that the traction has fields of its own beside the pressure."""
        return self.friction is not None and self.friction.weights is not None

    def _shares(self, motion: Motion) -> tuple[Array, Array]:
        """Return how much of pressure and traction each field takes in during a step, (K, 1, 1) each."""
        of_traction = self.sources[:, 1:] @ motion.direction
        return self.sources[:, 0, None, None], of_traction[:, None, None]

    def _source(self, motion: Motion, fields: MovingFields) -> Array:
        """Return the spectrum that each field takes in under the last tractions, (K, my/2 + 1, mx)."""
        of_pressure, of_traction = self._shares(motion)
        if fields.sheared is None:
            return (of_pressure + of_traction) * fields.pressure
        return of_pressure * fields.pressure + of_traction * fields.sheared

    def displacement(self, fields: MovingFields, pressure: Array) -> Array:
        """Return the displacement under the pressure, (nx, ny), from the fields after a step."""
        k = self.kernels.rates.size
        spectrum = self.spectra[0] * fields.pressure + jnp.sum(self.spectra[1 : k + 1] * fields.eta[:k], 0)
        return spectral.inverse(spectrum, pressure.shape, self._periodic)

    def by_traction(self, fields: MovingFields, motion: Motion, shape: tuple[int, ...]) -> Array | None:
        """Return the displacement u_q under the traction (comment on observables below), (nx, ny); None without friction."""
        if self.traction_at_once is None:
            return None
        k, last = self.kernels.rates.size, fields.pressure if fields.sheared is None else fields.sheared
        spectrum = jnp.tensordot(motion.direction, self.traction_at_once, 1) * last
        spectrum = spectrum + jnp.sum(self.spectra[1 + k :] * fields.eta[k:], 0)
        return spectral.inverse(spectrum, shape, self._periodic)

    @property
    def delayed_rates(self) -> Array:
        return self.kernels.rates

    def works(self, fields: MovingFields, pressure: Array) -> Array:
        """Return the works of the pressure alone, since friction adds little."""
        return self.kernels.works(pressure)

    def observe(
        self, fields: MovingFields, pressure: Array, motion: Motion, other: Array | None = None
    ) -> dict[str, Array]:
        """Return the forces, energies and places of the comment on observables below, and the film strain."""
        k, padded = self.kernels.rates.size, self._padded(pressure.shape)
        spectra, eta = self.spectra[: k + 1].real, fields.eta[:k]
        stored, dissipated = energies(spectra, self.rates[:k], eta, fields.pressure, padded)
        pressed = None if other is None else other[0]
        force, centre, leading_peak = self.observer.surface(pressure, motion.direction, pressed)

        # forces against the motion: of hysteresis, zero on an elastic body, and Coulomb's
        hysteresis = coulomb = jnp.zeros(())
        if self.inherits:
            displaced = self.by_traction(fields, motion, pressure.shape)
            if other is not None:
                moved = jnp.sum(other, 0)
                displaced = moved if displaced is None else displaced + moved
            hysteresis = self.observer.hysteresis(pressure, displaced, motion.direction)
        if self.friction is not None:
            sheared = pressure if motion.sheared is None else motion.sheared
            coulomb = self.friction.coulomb_force(sheared) * jnp.sum(motion.direction**2)

        # the strain of the film, whose history is kept as spectra
        strain, film = jnp.zeros(()), self.kernels.film_strain
        if film is not None:
            history = spectral.inverse(
                jnp.tensordot(film.weights[1:], eta, 1), pressure.shape, self._periodic
            )
            strain = deepest_strain(film.coefficients, film.weights[0] * pressure + history)
        return {
            "film_strain": strain,
            "lateral_force": force,
            "hysteresis_force": hysteresis,
            "coulomb_force": coulomb,
            "pressure_centre": centre,
            "leading_peak": leading_peak,
            "stored_energy": stored,
            "hysteresis_power": dissipated,
            "truncation_bound": fields.truncation_bound,
        }


def moving_memory(
    kernels: Kernels, profile: Array, ratio: Array, friction: FrictionKernels | None = None
) -> MovingMemory:
    """Return the memory of a surface from its kernels; profile: (nx, ny), scaled; friction: its kernels on the grid, or None
    without friction."""
    shape = profile.shape
    own = lambda a: jnp.concatenate([a[:1], jnp.tensordot(kernels.mix.T, a[1:], 1)])
    spectra, rates = own(kernels.family.spectrum), kernels.rates
    sources, traction_at_once = jnp.zeros((rates.size, 3)).at[:, 0].set(1.0), None
    if friction is not None:
        every = friction.spectra(shape)
        traction_at_once, lasting = every[0], friction.lasting(every)
        spectra = jnp.concatenate([spectra, lasting[:, 0], lasting[:, 1]])
        rates = jnp.concatenate([rates, friction.rates, friction.rates])
        sources = jnp.concatenate([sources, jnp.repeat(jnp.eye(3)[1:], friction.rates.size, 0)])
    return MovingMemory(
        spectra,
        own(kernels.family.circulant),
        rates,
        sources,
        traction_at_once,
        friction,
        spectral.inverse(spectra[1:], shape, kernels.family.periodic)[:, :, 0],
        ratio,
        kernels,
        Observer.of(profile, ratio, kernels.family.periodic),
    )


def absorption(n: int, padded: int) -> Array:
    """Return the absorption at each cell per cell moved, (padded,): zero in the window of n cells, a bump in the padding."""
    i = jnp.arange(padded)
    length = padded - n + 1
    bump = jnp.sin(jnp.pi * (i - n + 1) / length) ** 2 * (2.0 * ABSORPTION / length)
    return jnp.where(i < n, 0.0, bump)


def absorb(
    fields: MovingFields, motion: Motion, ratio: Array, shape: tuple[int, int], periodic: spectral.Periodic
) -> MovingFields:
    """Let the absorbing layer act for the way moved since it last did, once that is long enough."""
    if all(periodic) or not fields.eta.size:
        return fields
    (nx, ny), (mx, my) = shape, spectral.padded_shape(shape, periodic)
    across = motion.move.y is not None
    way_y = distance(motion.move.y) / (ratio * my) if across else jnp.zeros(())
    moved = fields.moved + jnp.stack([distance(motion.move.x) / mx, way_y])

    def act(fields: MovingFields) -> tuple[Array, Array]:
        rows = jnp.fft.ifft(fields.eta, axis=-1) * jnp.exp(-absorption(nx, mx) * mx * moved[0])
        if across and not periodic[1]:
            share = jnp.exp(-absorption(ny, my) * my * moved[1])[:, None]
            rows = jnp.fft.rfft(share * jnp.fft.irfft(rows, n=my, axis=-2), axis=-2)
        eta = jnp.fft.fft(rows, axis=-1)
        return eta, fields.lost + (fields.eta - eta)[:, 0, 0].real

    due = jnp.max(moved) >= ABSORB_AFTER
    eta, lost = jax.lax.cond(due, act, lambda f: (f.eta, f.lost), fields)
    return fields._replace(eta=eta, moved=jnp.where(due, 0.0, moved), lost=lost)


# Observables of sliding beyond the pressure: horizontal force, pressure centre, energies. All scaled.
#
# Force. The pressure acts normal to the indenter's surface z = approach - f(x, y), so that it pushes the
# indenter with the lateral force
#
#     F = -int p grad f dA.
#
# It opposes the motion where the pressure leans to the leading side. With friction the traction q = mu p e displaces
# the surface as well, by u_q, and the pressure acts as if on the profile f + u_q. The hysteresis force is the part
# that the pressure needs for the displacement that it causes itself,
#
#     F_h = -int p grad (f + u_q) dA = int p grad u_p dA,
#
# which is zero on an elastic body, and times the speed the power of the dashpots in the steady state. An indenter that
# creeps is at rest in its own frame: its displacement u_i under the pressure is that of a surface which keeps its place, and
# the pressure acts on the profile f + u_i. Once relaxed it takes no force, int p grad u_i dA = 0. Its displacement under
# the traction is a part of u_q, as is that of an elastic indenter. The difference,
# int p grad u_q dA, is of the order of Dundurs' constant times mu W times a slope of the profile. Linear theory knows
# such terms in part only (the slope under the traction and the elastic part of the slip velocity are of the same
# order), so that the totals below leave them out: the coefficient of friction of an elastic body is mu.
#
# Sign convention of all results of sliding and rolling: a force against the motion of the indenter and a power that
# is lost are positive. Totals, with Coulomb's force F_c = int mu p dA against the motion:
#
#     tangential_force = F_h + F_c,      power = hysteresis_power + friction_power,      friction_power = F_c |v|.
#
# Energy. The body is a chain of springs and dashpots (``RecursiveMemory``): with rates
# d eta_k = p - lambda_k eta_k, taken with the material,
#
#     stored = 1/2 <p, C_0 p> + 1/2 sum_k lambda_k <eta_k, (lambda_k C_k) eta_k>,
#     dissipated = sum_k <d eta_k, (lambda_k C_k) d eta_k>,
#
# and -F_h . v + load * rate of approach = d stored/dt + dissipated as long as nothing leaves the window. In the
# steady state, where the track carries stored energy away to dissipate it later, the dashpots take
#
#     -F_h . v = sum_k <p, (lambda_k C_k) d eta_k>.
#
# The sums are taken over Fourier modes (Parseval).


# weights of the differences across 2, 4 and 6 cells in a slope of sixth order
SIXTH = 45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0
WALL = 1.0  # a profile steeper than this is a wall, on which linear theory says nothing
NOISE = 1e-5  # part of the largest pressure below which a traction may be an error of the solver


@pytree
class Observer:
    """Forces on the indenter and the place of the contact, from a pressure and the profile.

    slopes of the profile and coordinates (places) of the cells, each (2, nx, ny) [in units of dx]; ratio: dy/dx, ();
    walls: whether there is a wall beside the cell along x and along y, whose slope is left out, (2, nx, ny) bool;
    periodic: along which axes differences go around, static.
    """

    slopes: Array
    places: Array
    ratio: Array
    walls: Array
    periodic: spectral.Periodic = static(default=spectral.FREE)

    @classmethod
    def of(cls, profile: Array, ratio: Array, periodic: spectral.Periodic = spectral.FREE) -> "Observer":
        nx, ny = profile.shape
        slopes = jnp.stack(
            [_slope(profile, axis, wraps, (1.0, ratio)[axis]) for axis, wraps in enumerate(periodic)]
        )
        x, y = jnp.arange(nx) - (nx - 1) / 2, (jnp.arange(ny) - (ny - 1) / 2) * ratio
        places = jnp.stack([jnp.broadcast_to(x[:, None], (nx, ny)), jnp.broadcast_to(y, (nx, ny))])
        slopes = jnp.where(jnp.abs(slopes) < WALL, slopes, 0.0)
        return cls(slopes, places, jnp.asarray(ratio), _walls_beside(profile, ratio, periodic), periodic)

    def walled(self, pressure: Array, direction: Array) -> Array:
        """Return whether a cell under pressure is at a wall that the motion meets, whose force the slopes leave out, ()."""
        met = self.walls & (direction != 0.0)[:, None, None]
        return jnp.any(met & (pressure != 0.0))

    def hysteresis(self, pressure: Array, displaced: Array | None, direction: Array) -> Array:
        """Return F_h against the motion, (); displaced: by other than the body's memory of the pressure, (nx, ny): u_q with
        friction, and the displacement of an indenter that creeps; None for zero."""
        return jnp.sum(jnp.tensordot(direction, self._slopes_with(displaced), 1) * pressure)

    def _slopes_with(self, displaced: Array | None) -> Array:
        """Return the slopes of the profile and of a displacement, (2, nx, ny)."""
        if displaced is None:
            return self.slopes
        along_x, along_y = (_central(displaced, axis, wraps) for axis, wraps in enumerate(self.periodic))
        return self.slopes + jnp.stack([along_x, along_y / self.ratio])  # bent at the edge of contact

    def surface(
        self, pressure: Array, direction: Array, of_indenter: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Return the lateral force (2,), the centre (2,), and the peak ahead of the axis, (); of_indenter: the displacement
        of an indenter that creeps under the pressure, (nx, ny), or None."""
        total = jnp.sum(pressure)
        force = -jnp.sum(self._slopes_with(of_indenter) * pressure, (1, 2))
        centre = jnp.sum(self.places * pressure, (1, 2)) / jnp.where(total > 0.0, total, 1.0)
        ahead = jnp.tensordot(direction, self.places, 1) >= 0.0
        return force, centre, jnp.max(jnp.where(ahead, pressure, 0.0))


def _walls_beside(profile: Array, ratio: Array | float, periodic: spectral.Periodic) -> Array:
    """Return whether there is a wall between a cell and one of its neighbours along x and along y, (2, nx, ny) bool.

    profile: in units of dx; ratio: dy/dx.
    """
    found = []
    for axis, wraps in enumerate(periodic):
        ahead = jnp.abs(jnp.roll(profile, -1, axis) - profile) >= WALL * (1.0, ratio)[axis]
        if not wraps:
            last = jnp.arange(profile.shape[axis]) == profile.shape[axis] - 1
            ahead = ahead & ~jnp.expand_dims(last, 1 - axis)
        found.append(ahead | jnp.roll(ahead, 1, axis))
    return jnp.stack(found)


def _central(field: Array, axis: int, wraps: bool) -> Array:
    """Return central differences, (nx, ny), one-sided at the ends of an axis that is not periodic; 0 along a single cell."""
    if field.shape[axis] == 1:
        return jnp.zeros_like(field)
    if wraps:
        return (jnp.roll(field, -1, axis) - jnp.roll(field, 1, axis)) / 2.0
    return jnp.asarray(jnp.gradient(field, axis=axis))


def _slope(field: Array, axis: int, wraps: bool, side: Array | float) -> Array:
    """Return the slope along an axis of cells of a side, (nx, ny).

    It is of sixth order: that of a wave of eight cells is 0.15 % too small, and that of central differences 10 %. Central
    differences are used near a wall, which thus does not act beyond its neighbours, and in the three cells at each end of an
    axis that is not periodic.
    """
    n, ahead = field.shape[axis], lambda k: jnp.roll(field, -k, axis)
    central = _central(field, axis, wraps)
    if n <= 2 * len(SIXTH):
        return central / side
    sixth = sum((w * (ahead(k) - ahead(-k)) for k, w in enumerate(SIXTH, 1)), start=jnp.zeros_like(field))
    wall = jnp.abs(ahead(1) - field) >= WALL * side  # between a cell and the next
    reach = range(-len(SIXTH), len(SIXTH))
    smooth = ~jnp.any(jnp.stack([jnp.roll(wall, -k, axis) for k in reach]), 0)
    if not wraps:
        inside = (jnp.arange(n) >= len(SIXTH)) & (jnp.arange(n) < n - len(SIXTH))
        smooth = smooth & jnp.expand_dims(inside, 1 - axis)
    return jnp.where(smooth, sixth, central) / side


def inner_product(weights: Array, squares: Array, padded: tuple[int, int]) -> Array:
    """Return sum_x f (K * f) over the padded grid from the spectra of K and |f|^2, both (..., my/2 + 1, mx)."""
    mx, my = padded
    return jnp.sum(jnp.sum(weights * squares, -1) * spectral.both_signs(my), -1) / (mx * my)


def energies(
    spectra: Array, rates: Array, eta: Array, pressure: Array, padded: tuple[int, int]
) -> tuple[Array, Array]:
    """Return stored energy and dissipated power by the formulas above; spectra: of C_0 and lambda_k C_k."""
    square = lambda f: f.real**2 + f.imag**2
    speed = pressure - rates[:, None, None] * eta
    springs = inner_product(spectra[1:], square(eta), padded)
    stored = 0.5 * inner_product(spectra[0], square(pressure), padded) + 0.5 * jnp.sum(rates * springs)
    return stored, jnp.sum(inner_product(spectra[1:], square(speed), padded))


def clearance(pressure: Array, ratio: Array) -> Array:
    """Free cells [along x] between the contact and the window's sides -x, +x; -y, +y, (2, 2).

    With adhesion the tractions of cells that do not touch are those of the attraction up to the solver's tolerance.
    """
    pressed = pressure > NOISE * jnp.max(jnp.abs(pressure))
    rows, columns = jnp.any(pressed, 1), jnp.any(pressed, 0)
    free = lambda active: jnp.where(jnp.any(active), jnp.argmax(active), active.size)
    along_x = jnp.stack([free(rows), free(rows[::-1])])
    return jnp.stack([along_x, jnp.stack([free(columns), free(columns[::-1])]) * ratio])


def truncation_of(tails: Array, lost: Array, clear: Array) -> tuple[Array, Array]:
    """Return the largest displacement in contact due to history that left the window, and whether it may lie under the
    contact.

    tails: response at offsets along x, (K, nx), falling with the distance; lost: sums of that history, (K,);
    clear: cells between the contact and where history was lost, (2, 2) as in ``clearance``.
    """
    nearest = jnp.min(clear)
    distance = jnp.clip(nearest, 0, tails.shape[1] - 1).astype(int)
    return jnp.sum(jnp.abs(tails[:, distance]) * jnp.abs(lost)), nearest <= 0.0


# Memory of films whose thickness changes in time: films that form or wear, alike everywhere or not.
#
# The displacement is stored, and only its increment in a step is the response of the layers of the present thickness h(t):
#
#     du = C_0(h) * dp + sum_k lambda_k C_k(h) * d eta_k,      eta_k' = p - lambda_k eta_k
#
# (C_k, lambda_k and eta_k of ``RecursiveMemory``; the rates do not depend on h). What is assumed:
#
# - the thickness is given in time, whatever the pressure;
# - a change of thickness by itself moves nothing. What forms fits itself to the surface as it lies there, deformed and
#   under pressure, and is not strained by the pressure under which it forms; what wears is a slice of the deformed
#   film, of one thickness everywhere, and what it was shortened by is not given back;
# - what forms creeps from then on as the film around it: it takes over the film's eta_k;
# - of layers that grow alike everywhere, displacement and approach are counted from the surface as the growth alone would
#   have left it. Where the thickness varies in the plane growth raises the surface: displacement is that of the surface,
#   elastic and viscous displacement less (h - h at first), and approach is counted from where the film is touched at first.
#
# Over a step the layers are taken as they are in its middle, which is of second order in the step. For layers that
# grow alike everywhere each step builds its kernels, so that it costs many times that of a film that stays as it is;
# for a film that varies in the plane the kernels are a series in the thickness, made once. Time grows as the number
# of steps.


class GrowthStep(NamedTuple):
    """dt [s], and the layers' thicknesses in the middle of the step [m], (layers,)."""

    dt: Array
    thicknesses: Array


class ThicknessStep(NamedTuple):
    """dt [s], and the thickness of a film that varies in the plane before and after the step [m], (nx, ny)."""

    dt: Array
    before: Array
    after: Array


class Grown(NamedTuple):
    """Fields of an ``IncrementalMemory``: eta (K, nx, ny) and displacement (nx, ny), scaled; film: the film strain of the
    last step's kernels, and works: their ``works`` under its pressure."""

    eta: Array
    displacement: Array
    film: FilmStrain | VaryingFilmStrain | None
    works: Array


class PredictedFields(NamedTuple):
    """Fields between ``predict`` and ``update``: eta, and the displacement left by earlier pressure, and the operator and
    the kernels of the step."""

    eta: Array
    earlier: Array
    operator: Operator
    kernels: Kernels


class IncrementalMemory(Memory):
    """The incremental form above, with kernels that may differ in each step.

    kernels: those from which the kernels of all steps are made, and whose rates all of them have.
    """

    kernels: Kernels

    @property
    def rates(self) -> Array:
        """lambda_k [1/s], (K,)."""
        return self.kernels.rates

    def kernels_at_first(self) -> Kernels:
        """Return the kernels of the body as it is before the first step."""
        return self.kernels

    def start(self, shape: tuple[int, int]) -> Grown:
        film = jax.tree.map(jnp.zeros_like, self.kernels_at_first().film_strain)
        none = jnp.zeros(1 + self.rates.size)
        return Grown(jnp.zeros((self.rates.size, *shape)), jnp.zeros(shape), film, none)

    @abc.abstractmethod
    def kernels_at(self, step: Any) -> Kernels:
        """Return the kernels of the body as it is in the middle of a step."""

    def raised(self, step: Any) -> Array | float:
        """Return how far growth has raised the surface at the end of a step since the start, scaled."""
        return 0.0

    def predict(self, fields: Grown, pressure: Array, step: Any) -> Prediction:
        k = self.kernels_at(step)
        decay, old, new = ramps(self.rates * step.dt)
        eta = decay[:, None, None] * fields.eta + jnp.tensordot(step.dt * old, pressure, 0)
        change = jnp.tensordot(k.mix, eta - fields.eta, 1)
        earlier = fields.displacement + k.family.superposed(jnp.concatenate([-pressure[None], change]))
        operator = k.family.combined([1.0, *(k.mix @ (step.dt * new))])
        return Prediction(operator, earlier, PredictedFields(eta, earlier, operator, k), self.raised(step))

    def update(self, fields: PredictedFields, pressure: Array, step: Any) -> Grown:
        new = step.dt * ramps(self.rates * step.dt)[2]
        displacement = fields.earlier + fields.operator(pressure)
        kernels = fields.kernels
        works = kernels.works(jax.lax.stop_gradient(pressure))
        return Grown(fields.eta + jnp.tensordot(new, pressure, 0), displacement, kernels.film_strain, works)

    @property
    def delayed_rates(self) -> Array:
        return self.rates

    def works(self, fields: Grown, pressure: Array) -> Array:
        return fields.works

    def observe(
        self, fields: Grown, pressure: Array, step: Any, other: Array | None = None
    ) -> dict[str, Array]:
        """Return the strain of a film that has always been as thick as in the middle of the step."""
        if fields.film is None:
            return {"film_strain": jnp.zeros(())}
        return {"film_strain": fields.film.strain(pressure, fields.eta)}


@pytree
class GrowingMemory(IncrementalMemory):
    """Layers that grow alike everywhere, over kernels built anew for each step; kernels: those of the first thicknesses."""

    body: LayeredHalfSpace
    indenter: Indenter
    grid: Grid
    kernels: Kernels

    def kernels_at(self, step: GrowthStep) -> Kernels:
        return build(self.body.with_thicknesses(step.thicknesses), self.indenter, self.grid)


@pytree
class VaryingMemory(IncrementalMemory):
    """A film whose thickness varies in the plane and in time; at_first: its thickness at the start [m], (nx, ny).

    What grows raises the surface, and what is worn away lowers it.
    """

    kernels: Kernels
    at_first: Array

    def kernels_at_first(self) -> Kernels:
        return self.kernels.at(self.at_first)

    def kernels_at(self, step: ThicknessStep) -> Kernels:
        return self.kernels.at((step.before + step.after) / 2.0)

    def raised(self, step: ThicknessStep) -> Array:
        return (step.after - self.at_first) / self.kernels.scale.length


# The direct superposition of all earlier steps: the oracle of the recursion, and the paper's method.
#
#     u(t_n) = sum_{j <= n} Kbar(n, j) * (p_j - p_{j-1}),
#
# with Kbar(n, j) the mean of the kernel K(t_n - s) over t_{j-1} <= s <= t_j: exact for a pressure linear
# over each step. Time and memory grow with the square and the first power of the number of steps.
# Each kernel is a weighted sum of the same images, so only their weights depend on (n, j).


@pytree
class LagRow:
    """One step n of the tables: its index, the image weights (n_steps, J) and the film's J (n_steps,)."""

    index: Array
    weights: Array
    film: Array


@pytree
class DirectMemory(Memory):
    """Fields: the pressure increments of all steps, (n_steps, nx, ny); step: a ``LagRow``; surface: the delayed
    compliance of the material at the surface."""

    images: ImageKernels
    surface: Delayed
    n_steps: int = static()

    def start(self, shape: tuple[int, int]) -> Array:
        return jnp.zeros((self.n_steps, *shape))

    def predict(self, increments: Array, pressure: Array, row: LagRow) -> Prediction:
        """Return the prediction. The operator acts on the whole new pressure, of which the previous one has been counted
        already, and is therefore subtracted."""
        now = row.weights[row.index]
        past = jnp.where(jnp.arange(self.n_steps)[:, None] <= row.index, row.weights, 0.0)
        earlier = self.images.family.superposed(
            jnp.tensordot(past.T, increments, 1) - now[:, None, None] * pressure
        )
        operator = self.images.family.combined(list(now))
        return Prediction(operator, earlier, increments.at[row.index].add(-pressure))

    def update(self, increments: Array, pressure: Array, row: LagRow) -> Array:
        return increments.at[row.index].add(pressure)

    @property
    def delayed_rates(self) -> Array:
        return self.surface.rates

    def works(self, increments: Array, pressure: Array) -> Array:
        return jnp.append(1.0, self.surface.shares)

    def observe(
        self, increments: Array, pressure: Array, row: LagRow, other: Array | None = None
    ) -> dict[str, Array]:
        if self.images.film_coefficients is None:
            return {"film_strain": jnp.zeros(())}
        strain = jnp.tensordot(row.film, increments, 1) / self.images.scale.compliance
        return {"film_strain": deepest_strain(self.images.film_coefficients, strain)}


def rows(body: LayeredHalfSpace, indenter: Indenter, times: Array, *, quasi_elastic: bool) -> LagRow:
    """Return the rows of all steps, stacked: weights (n, n, J) and film (n, n), of which columns j > n are not used."""
    before = jnp.append(times[:1], times[:-1])
    start = jnp.maximum(times[:, None] - times[None, :], 0.0)
    end = jnp.maximum(times[:, None] - before[None, :], 0.0)
    weights = image_weights(body, indenter, start, end, quasi_elastic=quasi_elastic)
    top, n = top_layer(body), times.shape[0]
    film = jnp.zeros((n, n))
    if top is not None:
        film = jnp.tril(film_creep(top).mean_creep(start, end))
    return LagRow(jnp.arange(n), weights, film)
