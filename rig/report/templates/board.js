"use strict";
const SHOWN_S = 6, REST_S = 3, ASK_MS = 1000, LETTER_MM = 36;
const still = matchMedia("(prefers-reduced-motion: reduce)");
let stop = () => {};

const element = (parent, name, attributes, text = "") => {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.textContent = text;
  parent.append(node);
  return node;
};

const play = () => {
  stop();
  const figure = document.querySelector("[data-picture]");
  if (!figure) return;
  const { end_s: end, box: [width, bottom, top], names, lamps, moments, apart_cm: apart } =
    JSON.parse(figure.dataset.picture);
  const svg = figure.querySelector("svg"), button = figure.querySelector("button");
  const two = names.length > 1, last = moments.length - 1;
  svg.setAttribute("viewBox", `-60 ${-top - 90} ${width + (two ? 320 : 100)} ${top - bottom + 110}`);
  let lamp = null, [lastX, lastZ] = [NaN, NaN];
  for (const [channel, x, z] of lamps) {
    const near = x === lastX && Math.abs(z - lastZ) < LETTER_MM;
    if (near) lamp.textContent = `${channel},${lamp.textContent}`;
    else lamp = element(svg, "text", { class: "lamp", x: x - 12, y: 12 - z, "text-anchor": "end" }, channel);
    [lastX, lastZ] = near ? [lastX, lastZ] : [x, z];
  }
  for (const [x, name] of names) element(svg, "text", { x, y: -top - 30, "text-anchor": "middle" }, name);
  const lines = Array.from({ length: Math.max(...moments.map((moment) => moment.length)) },
    () => element(svg, "line", {}));
  const size = element(svg, "text", { class: "apart", x: width - 50 });

  /** Show a moment, or how it is on its way to the next. */
  const show = (at) => {
    const before = Math.floor(at), now = moments[before], then = moments[Math.min(before + 1, last)];
    const share = now.length === then.length ? at - before : 0;
    lines.forEach((line, number) => {
      if (number >= now.length) { line.setAttribute("class", "none"); return; }
      const [x1, y1, x2, y2, color] = now[number].map((value, part) =>
        (part < 4 ? (value + share * (then[number]?.[part] - value || 0)) * (part % 2 ? -1 : 1) : value));
      Object.entries({ x1, y1, x2, y2, class: color })
        .forEach(([key, value]) => line.setAttribute(key, value));
    });
    const known = apart[before] !== null;
    size.textContent = known ? `Δz ${apart[before].toFixed(1).replace("-", "−")} cm` : "";
    if (known) size.setAttribute("y", 25 - (now.at(-1)[1] + now.at(-2)[1]) / 2);
  };

  show(last);
  if (!last) return;
  figure.querySelector(".pace").textContent =
    `slow motion: ${(SHOWN_S / end).toFixed(0)} times as long`;
  let begun = performance.now(), halted = still.matches ? SHOWN_S : null, frame = 0;
  const tick = (now) => {
    const at = Math.max(0, (now - begun) / 1000) % (SHOWN_S + REST_S);
    show(Math.min(last, (at / SHOWN_S) * last));
    frame = requestAnimationFrame(tick);
  };
  const go = () => {
    button.textContent = halted === null ? "Pause" : "Play";
    if (halted === null) frame = requestAnimationFrame(tick); else cancelAnimationFrame(frame);
  };
  button.addEventListener("click", () => {
    const now = performance.now() / 1000;
    if (halted === null) halted = now - begun / 1000;
    else [begun, halted] = [1000 * (now - halted), null];
    go();
  });
  stop = () => cancelAnimationFrame(frame);
  button.hidden = false;
  go();
};

let tag = null;
const ask = async () => {
  const lost = document.querySelector("#lost");
  try {
    const answer = document.hidden ? null : await fetch("/", { cache: "no-cache" });
    const other = answer && answer.headers.get("ETag");
    if (other && other !== tag) {
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      const [old, fresh] = [document, page].map((from) => from.querySelector("#board"));
      const moved = (from) => from.querySelector("[data-picture]")?.dataset.picture;
      const kept = moved(old) === moved(fresh) ? old.querySelector("[data-picture]") : null;
      if (tag !== null || !old.isEqualNode(fresh)) {
        if (kept) fresh.querySelector("[data-picture]").replaceWith(kept);
        old.replaceWith(fresh);
        document.title = page.title;
        if (!kept) play();
      }
      tag = other;
    }
    lost.textContent = "";
  } catch {
    lost.textContent = "The page is not reached; trying again …";
  }
  setTimeout(ask, ASK_MS);
};
play();
ask();
