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
const place = (line, x1, z1, x2, z2) =>
  Object.entries({ x1, y1: -z1, x2, y2: -z2 }).forEach(([key, value]) => line.setAttribute(key, value));

/** Draw a body once; the function that comes back moves it to a height. */
const draw = (svg, body, kind) => {
  const shapes = body.rods.map(() => body.radius
    ? element(svg, "circle", { class: `rod ${kind}`, cx: body.x, r: body.radius })
    : element(svg, "line", { class: `rod ${kind}` }));
  return (height) => shapes.forEach((shape, number) => {
    shape.style.display = height === null ? "none" : "";
    if (height === null) return;
    if (body.radius) { shape.setAttribute("cy", -height); return; }
    let [rise, across, up] = body.rods[number], z = height + rise;
    if (body.lies && z < 0) [z, across, up] = [0, Math.hypot(across, up), 0];
    place(shape, body.x - across, z - up, body.x + across, z + up);
  });
};

const play = () => {
  stop();
  const figure = document.querySelector("[data-picture]");
  if (!figure) return;
  const { width, bottom, top, end_s: end, still: strokes, lamps, bodies } =
    JSON.parse(figure.dataset.picture);
  const svg = figure.querySelector("svg"), button = figure.querySelector("button");
  svg.setAttribute("viewBox", `-60 ${-top - 90} ${width + (bodies.length > 1 ? 320 : 100)} ${top - bottom + 110}`);
  for (const [kind, ...ends] of strokes) place(element(svg, "line", { class: kind }), ...ends);
  let lamp = null, [lastX, lastZ] = [NaN, NaN];
  for (const [channel, x, z] of lamps) {
    const near = x === lastX && Math.abs(z - lastZ) < LETTER_MM;
    if (near) lamp.textContent = `${channel},${lamp.textContent}`;
    else lamp = element(svg, "text", { class: "lamp", x: x - 12, y: 12 - z, "text-anchor": "end" }, channel);
    [lastX, lastZ] = near ? [lastX, lastZ] : [x, z];
  }
  for (const { x, words } of bodies) {
    element(svg, "text", { x, y: -top - 30, "text-anchor": "middle" }, words);
  }
  const moves = bodies.flatMap((body) => [
    [draw(svg, body, "model"), body.model], [draw(svg, body, body.role), body.seen]]);
  const bracket = [1, 2, 3].map(() => element(svg, "line", { class: "apart" }));
  const size = element(svg, "text", { class: "apart", x: width - 50 });
  const last = bodies[0].model.length - 1;

  const show = (moment) => {
    for (const [move, heights] of moves) move(heights[moment]);
    // Both chains are seen only so far: later nothing is known of the distance.
    const until = Math.min(moment, ...bodies.map((body) => body.last));
    const known = bodies.length > 1 && bodies.every((body) => until >= body.known);
    if (known) {
      const [low, high] = bodies.map((body) => body.seen[until] + body.top), x = width - 100;
      place(bracket[0], x, low, x, high);
      [low, high].forEach((z, side) => place(bracket[side + 1], x - 30, z, x + 30, z));
      size.setAttribute("y", 25 - (low + high) / 2);
      size.textContent = `Δz ${((high - low) / 10).toFixed(1)} cm`;
    } else size.textContent = "";
    for (const line of bracket) line.style.display = known ? "" : "none";
  };

  show(last);
  if (!last) return;
  figure.querySelector(".pace").textContent =
    `slow motion: ${(SHOWN_S / end).toFixed(0)} times as long`;
  let begun = performance.now(), halted = still.matches ? SHOWN_S : null, frame = 0;
  const tick = (now) => {
    const at = Math.max(0, (now - begun) / 1000) % (SHOWN_S + REST_S);
    show(Math.min(last, Math.round((at / SHOWN_S) * last)));
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
