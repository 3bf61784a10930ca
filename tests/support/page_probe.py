"""JavaScript with which tests read the curves of the page with sliders in a browser."""

POINTS = """
const points = (kind) => [...document.querySelectorAll(kind)].at(-1)?.getAttribute("points");
const heights = (text) => text.split(" ").map((one) => Number(one.split(",")[1]));
// the former curve, on axes that have followed the new one: the same but for a factor and an offset of its heights
const alike = (one, other) => {
  const [a, b] = [heights(one), heights(other)], last = a.length - 1;
  const part = (list, i) => (list[i] - list[0]) / (list[last] - list[0]);
  return a.length === b.length && a.every((_, i) => Math.abs(part(a, i) - part(b, i)) < 0.02);
};
"""
