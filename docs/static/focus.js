/* Wide code and tables scroll; the keyboard reaches them too. */
document.addEventListener("DOMContentLoaded", () => {
  for (const box of document.querySelectorAll("div.highlight pre, .table-wrapper, div.math")) box.tabIndex = 0;
});
