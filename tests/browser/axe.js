const findings = {};
for (const page of PAGES) {
  const frame = await visit(page), inside = frame.contentWindow, { body } = inside.document;
  const script = inside.document.createElement("script");
  script.src = "SOURCE";
  await new Promise((loaded) => { script.onload = loaded; body.append(script); });
  const { violations, passes } = await inside.axe.run(inside.document);
  const places = violations.flatMap((rule) => rule.nodes.map((node) => [rule.id, node.target]));
  const wide = inside.document.documentElement.scrollWidth > inside.innerWidth;
  findings[page] = [places, wide, body.dataset.mdColorScheme ?? null, passes.length > 10];
  frame.remove();
}
tell(findings);
