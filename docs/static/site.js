// What the theme leaves out for readers without a mouse or a screen: levels of headings, names of regions, focus.
"use strict";

function name(selector, attributes) {
  for (const element of document.querySelectorAll(selector))
    for (const [attribute, value] of Object.entries(attributes)) element.setAttribute(attribute, value);
}

// A signature on several lines is no list of definitions.
function divisions(list) {
  const division = document.createElement("div");
  for (const item of list.children) {
    const line = document.createElement("div");
    line.className = "parameter";
    line.append(...item.childNodes);
    division.append(line);
  }
  list.replaceWith(division);
}

// The page of search results has none.
function giveTitle() {
  if (document.querySelector("h1")) return;
  const title = document.createElement("h1");
  title.textContent = document.title.split(" - ")[0];
  document.querySelector("article")?.prepend(title);
}

// Long names in tables are broken between their parts.
function breakNames() {
  for (const name of document.querySelectorAll("td code .pre")) {
    const parts = name.textContent.split(/(?<=[/_]|::)/);
    name.replaceChildren(...parts.flatMap((part, i) => (i ? [document.createElement("wbr"), part] : [part])));
  }
}

// A picture of several panels side by side keeps a size at which it can be read, and scrolls.
function keepReadable() {
  for (const picture of document.querySelectorAll(".cell_output img"))
    if (picture.naturalWidth > 1.8 * picture.naturalHeight) picture.style.maxWidth = "max(100%, 40rem)";
  focusWhatScrolls();
}

function focusWhatScrolls() {
  for (const element of document.querySelectorAll("article pre, article .highlight, .table-wrapper, div.math, figure.wide, .cell_output, .cell_output *"))
    if (element.scrollWidth > element.clientWidth + 1 && getComputedStyle(element).overflowX === "auto") element.tabIndex = 0;
}

addEventListener("DOMContentLoaded", () => {
  name('[role="heading"]:not([aria-level])', { "aria-level": "2" });
  name(".sidebar-drawer", { "aria-label": "Pages" });
  name(".toc-drawer", { "aria-label": "On this page" });
  name(".content-icon-container", { role: "navigation", "aria-label": "Source and colours of this page" });
  name("label.overlay", { "aria-hidden": "true" }); // beside a drawer that is open: for the mouse only
  giveTitle();
  document.querySelectorAll("dt.sig > dl").forEach(divisions);
  breakNames();
  focusWhatScrolls();
  addEventListener("resize", focusWhatScrolls);
});
addEventListener("load", keepReadable);
