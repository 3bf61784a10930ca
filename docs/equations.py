r"""The equations of docstrings, which are plain text in Python, as LaTeX for the pages.

A key is the text of a docstring with single spaces. That each is still one is
tested in tests/project/test_docs.py.
"""

EQUATIONS = {
    "force = G size d^p f(d)/(1 - nu) + baseline + tilt t, d = max(depth - contact point, 0)": (
        r"\text{force} = \frac{G \; \text{size} \; d^p f(d)}{1 - \nu} + \text{baseline} + \text{tilt} \; t, \qquad"
        r" d = \max(\text{depth} - \text{contact point}, 0)"
    ),
    "G(t) = Ge + sum_i G_i exp(-t/tau_i), G*(omega) = Ge + sum_i G_i i omega tau_i/(1 + i omega tau_i)": (
        r"G(t) = G_e + \sum_i G_i e^{-t/\tau_i}, \qquad"
        r" G^*(\omega) = G_e + \sum_i G_i \frac{i \omega \tau_i}{1 + i \omega \tau_i}"
    ),
    "b_T G(omega, T) = G(a_T omega, T0) WLF: log10 a_T = -c1 (T - T0)/(c2 + T - T0),"
    " Arrhenius: ln a_T = activation_energy/k (1/T - 1/T0)": (
        r"b_T G(\omega, T) = G(a_T \omega, T_0), \quad"
        r" \log_{10} a_T = -\frac{c_1 (T - T_0)}{c_2 + T - T_0} \; \text{(WLF)}, \quad"
        r" \ln a_T = \frac{\text{activation energy}}{k} \left( \frac{1}{T} - \frac{1}{T_0} \right) \; \text{(Arrhenius)}"
    ),
    "dh/dt = rate exp(-(activation_energy - activation_volume stress)/(k T)) - removal_rate h": (
        r"\frac{dh}{dt} = \text{rate} \exp\left( -\frac{\text{activation energy} - \text{activation volume} \cdot"
        r" \text{stress}}{k T} \right) - \text{removal rate} \cdot h"
    ),
    "dh/dt = R - removal_rate h, R = rate exp(-(activation_energy - activation_volume stress)/(k T))"
    " h(t) = initial exp(-removal_rate t) + R (1 - exp(-removal_rate t))/removal_rate": (
        r"\frac{dh}{dt} = R - \text{removal rate} \cdot h, \qquad"
        r" R = \text{rate} \exp\left( -\frac{\text{activation energy} - \text{activation volume} \cdot \text{stress}}"
        r"{k T} \right), \qquad"
        r" h(t) = \text{initial} \cdot e^{-\text{removal rate} \cdot t} + \frac{R}{\text{removal rate}}"
        r" \left( 1 - e^{-\text{removal rate} \cdot t} \right)"
    ),
    "dh/dt = rate exp(-(activation_energy - activation_volume stress)/(k T))": (
        r"\frac{dh}{dt} = \text{rate} \exp\left( -\frac{\text{activation energy} - \text{activation volume} \cdot"
        r" \text{stress}}{k T} \right)"
    ),
    "T(k) = q(k)/(conductivity sqrt(|k|^2 - i k . v/diffusivity))": (
        r"T(\mathbf{k}) = \frac{q(\mathbf{k})}"
        r"{\text{conductivity} \sqrt{|\mathbf{k}|^2 - i \, \mathbf{k} \cdot \mathbf{v} / \text{diffusivity}}}"
    ),
    "T1 + K1 q1 = T2 + K2 (q - q1), q1 = 0 where q = 0,": (
        r"T_1 + K_1 q_1 = T_2 + K_2 (q - q_1), \qquad q_1 = 0 \; \text{where} \; q = 0,"
    ),
    "J(t) = gamma(t) / tau0 [1/Pa],": r"J(t) = \gamma(t) / \tau_0 \quad [1/\mathrm{Pa}],",
    "nu(s) = (3 K j - 2)/(6 K j + 2), j = s J(s),": (
        r"\nu(s) = \frac{3 K j - 2}{6 K j + 2}, \qquad j = s J(s),"
    ),
    "| L c^2 + T s^2 (L - T) c s i K c | u = | (L - T) c s L s^2 + T c^2 i K s | t | -i K c -i K s N |": (
        r"\mathbf{u} = \begin{pmatrix} L c^2 + T s^2 & (L - T) c s & i K c \\"
        r" (L - T) c s & L s^2 + T c^2 & i K s \\ -i K c & -i K s & N \end{pmatrix} \mathbf{t}"
    ),
    "u(x, t) = int_0^t K(x, t - s) * dp(x, s), g = profile + u - approach >= 0, p >= 0, p g = 0": (
        r"u(\mathbf{x}, t) = \int_0^t K(\mathbf{x}, t - s) * dp(\mathbf{x}, s), \qquad"
        r" g = \text{profile} + u - \text{approach} \ge 0, \quad p \ge 0, \quad p \, g = 0"
    ),
    "u(x, t) = int_0^t K(x + X(t) - X(s), t - s) * dp(x, s), g = profile + u - approach >= 0, p >= 0, p g = 0": (
        r"u(\mathbf{x}, t) = \int_0^t K(\mathbf{x} + \mathbf{X}(t) - \mathbf{X}(s), t - s) * dp(\mathbf{x}, s),"
        r" \qquad g = \text{profile} + u - \text{approach} \ge 0, \quad p \ge 0, \quad p \, g = 0"
    ),
    "u(x) = int_0^infinity dK/ds * p(x + v s) ds, g = profile + u - approach >= 0, p >= 0, p g = 0": (
        r"u(\mathbf{x}) = \int_0^\infty \frac{dK}{ds} * p(\mathbf{x} + \mathbf{v} s) \, ds, \qquad"
        r" g = \text{profile} + u - \text{approach} \ge 0, \quad p \ge 0, \quad p \, g = 0"
    ),
    "|q| <= mu p, slip = 0 where |q| < mu p, slip = -k q, k >= 0, where |q| = mu p": (
        r"|\mathbf{q}| \le \mu p, \qquad \text{slip} = 0 \; \text{where} \; |\mathbf{q}| < \mu p, \qquad"
        r" \text{slip} = -k \mathbf{q}, \; k \ge 0, \; \text{where} \; |\mathbf{q}| = \mu p"
    ),
    "slip/distance = -v/|v| . grad u - creepage - spin (-y, x) |q| <= mu p, slip = -k q, k >= 0, where |q| = mu p": (
        r"\frac{\text{slip}}{\text{distance}} = -\frac{\mathbf{v}}{|\mathbf{v}|} \cdot \nabla \mathbf{u}"
        r" - \text{creepage} - \text{spin} \, (-y, x), \qquad"
        r" |\mathbf{q}| \le \mu p, \qquad"
        r" \text{slip} = -k \mathbf{q}, \; k \ge 0, \; \text{where} \; |\mathbf{q}| = \mu p"
    ),
    "dh/dt = law(p, h, T, v), h >= 0": r"\frac{dh}{dt} = \text{law}(p, h, T, \mathbf{v}), \qquad h \ge 0",
    "sigma_ij(x, z, T) = sum over cells of int S_ijk(x - x', z, T - t) d t_k(x', t)": (
        r"\sigma_{ij}(\mathbf{x}, z, T) = \sum_{\mathbf{x}'}"
        r" \int S_{ijk}(\mathbf{x} - \mathbf{x}', z, T - t) \, dt_k(\mathbf{x}', t)"
    ),
}
