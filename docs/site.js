// What the theme leaves out for those who read with a keyboard or hear the page.
const article = document.querySelector("article");

const mend = () => {
  for (const part of article.querySelectorAll("pre > code, .md-typeset__scrollwrap")) {
    if (part.scrollWidth > part.clientWidth) part.tabIndex = 0; // scrolls by the arrow keys
  }
  article.querySelectorAll("pre > nav").forEach((buttons, number) => {
    buttons.setAttribute("aria-label", `Code block ${number + 1}`); // each needs its own name
  });
};

document.querySelector(".md-search").setAttribute("aria-label", "Search");
for (const heading of article.querySelectorAll("th:empty")) {
  heading.replaceWith(document.createElement("td"));
}
new MutationObserver(mend).observe(article, { childList: true, subtree: true });
addEventListener("load", mend);
addEventListener("resize", mend);
