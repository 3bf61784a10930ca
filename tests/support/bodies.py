"""The bodies that many tests share: the paper's film on steel under its ball, and a half-space of glass."""

import jaxcontact as jc

STEEL = jc.Elastic.from_young(210e9, nu=0.3)
# the paper's Eq. (14), with J = 2 phi
FILM = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
BODY = jc.LayeredHalfSpace([jc.Layer(FILM, thickness=150e-9)], substrate=STEEL)
BALL = jc.Sphere(radius=9.525e-3, material=STEEL)
GLASS = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
