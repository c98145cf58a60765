document.querySelectorAll("table.sortable").forEach((table) => {
  const number = (words) => parseFloat(words.replace("−", "-"));
  table.querySelectorAll("th").forEach((heading, place) => {
    const button = document.createElement("button");
    button.textContent = heading.textContent;
    heading.replaceChildren(button);
    button.addEventListener("click", () => {
      const way = heading.ariaSort === "ascending" ? -1 : 1;
      table.querySelectorAll("th").forEach((other) => other.removeAttribute("aria-sort"));
      heading.ariaSort = way === 1 ? "ascending" : "descending";
      const key = (row) => row.cells[place].textContent;
      const rows = [...table.tBodies[0].rows];
      rows.sort((a, b) => way * (number(key(a)) - number(key(b)) || key(a).localeCompare(key(b))));
      table.tBodies[0].append(...rows);
    });
  });
});
