// A row whose first cell links into the page is a link as a whole.

/** The name in "#name"; one that is not percent-encoded stands for itself. */
export function fragment(address) {
  const name = address.slice(1);
  try {
    return decodeURIComponent(name);
  } catch {
    return name;
  }
}

const targetOf = (link) => document.getElementById(fragment(link.getAttribute("href")));

/** Opens the row's cell (a <details>) and goes there; a click on a link or on selected text does what it always does. */
export function openCellsByRow(root) {
  for (const link of root.querySelectorAll('td:first-child > a[href^="#"]')) {
    const row = link.closest("tr");
    if (!targetOf(link)) continue;  // a cell that the page tells of in its tables alone
    row.classList.add("opens");
    row.addEventListener("click", (event) => {
      if (event.target.closest("a, button") || String(getSelection())) return;
      link.click();
    });
  }
  // A cell that was closed again would not open by the same link: the address does not change.
  root.addEventListener("click", (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    const target = link && targetOf(link);
    if (target?.tagName === "DETAILS") target.open = true;
  });
}
