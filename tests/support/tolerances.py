"""The tolerances of the tests, by kind."""

LAST_BITS = 1e-15  # the same operations, compiled another way: the last bits of a double
ROUND_OFF = 1e-12  # the same mathematics in another order
SEPARATION = 1e-6  # decay rates shared by all wavenumbers, paper's film (measured: 1e-13 of the response)
# round-off in sums over images whose heights alternate at 1e8 times the first (measured: 3e-11)
ALTERNATING = 1e-10
IMAGES = 1e-8  # least-squares images of a response, of its own size (measured: 3e-9)
SOLVER = 1e-7  # contact solved to 1e-8, the default
TIGHT_SOLVER = 1e-9  # contact solved to 1e-12
DENSE = 2e-3  # parameters of a fit through the solver, whose grid is chosen for a thousandth
APPROACH = 5e-4  # discretisation at N = 256: approach
PEAK = 2e-3  # discretisation at N = 256: peak pressure
PEAK_ON_FEW_CELLS = 0.02  # discretisation: peak over mean pressure, 15 cells to the edge (measured: 1.2e-2)
RADIUS = 1e-3  # discretisation at N = 128, some 100 cells across: radius (measured: 7e-4)
PUBLISHED = 3e-3  # the paper's own approaches, low by its discretisation
MODES = 1e-8  # reverse against forward mode, tangents solved to 1e-10
CENTRAL_DIFFERENCE = 1e-5  # central differences with a step of 3e-4 in log parameters (measured: 3e-6)

# what is foretold of a contact before it is solved
# Hertz's pressure in place of the film's own (measured: 0.08 at nu = 0.3, 0.17 at 0.49)
FORETOLD_RADIUS = 0.18
FORETOLD_STRAIN = 1.55  # a factor: 0.65 where the pressure of a film that keeps its volume is peaked
QUADRATURE = 2e-4  # the integral over wavenumbers against Hertz
