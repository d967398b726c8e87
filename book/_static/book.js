// Whatever scrolls sideways in itself (a formula, a table, a cell) can be reached and scrolled with the keyboard.
(() => {
  const KINDS = [
    ["div.math, span.math", "Formula"],
    [".pst-scrollable-table-container", "Table"],
    ["div.highlight pre", "Code"],
    ["div.output pre", "Output"],
  ];

  function markScrolling() {
    for (const [selector, name] of KINDS) {
      for (const element of document.querySelectorAll(selector)) {
        if (element.scrollWidth > element.clientWidth + 1) {
          element.tabIndex = 0;
          element.setAttribute("role", "group");
          element.setAttribute("aria-label", `${name}, scrolls sideways`);
        } else if (element.getAttribute("role") === "group") {
          for (const attribute of ["tabindex", "role", "aria-label"]) element.removeAttribute(attribute);
        }
      }
    }
  }

  async function start() {
    await window.MathJax?.startup?.promise;
    markScrolling();
    new ResizeObserver(markScrolling).observe(document.body);
    // A folded answer has no width until it is opened.
    document.addEventListener("toggle", markScrolling, true);
  }

  window.addEventListener("load", start);
})();
