const inside = (await visit("docs/method.html")).contentWindow, page = inside.document;
const field = page.querySelector("[data-md-component=search-query]");
page.querySelector("#__search").click();
field.focus();
field.value = "photogate";
field.dispatchEvent(new inside.Event("input", { bubbles: true }));
const results = page.querySelector(".md-search-result__meta");
new MutationObserver(() => tell(results.textContent)).observe(results, { childList: true });
