// The player: slider, keys, play button and pointers choose the frame; stage, chart and readout follow.
const { save, svgText, csv, player } = window.ploughval;
const { Stage, Chart, dots, fixed, withStd, minus, COLOURS, svg } = player;
const room = document.querySelector("[data-player=room]");
const PLAY = "M4 2.5v11l9.5-5.5z", PAUSE = "M3.5 2.5h3.2v11H3.5zM9.3 2.5h3.2v11H9.3z";
const AHEAD = 4;

function start() {
  const part = (name) => room.querySelector(`[data-player="${name}"]`);
  const data = JSON.parse(document.getElementById("player-data").textContent), frames = data.frames;
  const stage = new Stage(part("stage"), data, dots(data)), slider = part("slider");
  const chart = data.force ? new Chart(part("force"), data) : null;
  const pictured = frames.map((_, k) => k).filter((k) => stage.address(k) !== null);
  const stops = pictured.length > 1 ? pictured : frames.map((_, k) => k);
  part("why").hidden = !frames.some((frame) => frame.why || frame.unread || frame.note);
  let now = Number(slider.value), timer = 0, width = 0;

  function lay() {
    const wide = Math.round(part("stage").getBoundingClientRect().width);
    if (!wide || wide === width) return;
    width = wide;
    stage.lay(wide);
    if (chart) {
      const across = Math.round(part("force").getBoundingClientRect().width), beside = across < 0.6 * wide;
      const room = beside ? part("stage").viewBox.baseVal.height - 240 : 0.8 * across;
      chart.lay(across, Math.round(Math.max(230, Math.min(beside ? 420 : 330, room))));
    }
    show(now);
  }

  function show(k) {
    now = Math.max(0, Math.min(frames.length - 1, k));
    const frame = frames[now];
    slider.value = now;
    stage.show(now);
    chart?.show(frame);
    const travel = frame.u === null ? "travel not known" : `u ${fixed(frame.u, 1)} mm`;
    const force = frame.P === null ? "" : `, force ${fixed(frame.P, 1)} N`;
    slider.setAttribute("aria-valuetext", `frame ${frame.n} of ${frames.at(-1).n}, ${travel}${force}${frame.why ? `, lost: ${frame.why}` : ""}`);
    part("stage").setAttribute("aria-label", `Frame ${frame.n}, ${travel}: ${data.panels.join(" above ")}.`);
    const unread = frame.unread && `The photograph of frame ${frame.n} cannot be read: ${frame.unread}`;
    const said = [frame.why && `Frame ${frame.n} was lost: ${frame.why}`, unread, frame.note].filter(Boolean).join(" \u00b7 ");
    // Where some frame has a remark, its place is kept: nothing jumps while the film runs.
    part("why").textContent = said;
    part("why").style.visibility = said ? "visible" : "hidden";
    // The slider says its own value; what plays is not read out.
    part("readout").setAttribute("aria-live", timer || document.activeElement === slider ? "off" : "polite");
    part("readout").replaceChildren(...readout(frame));
    if (timer) for (let next = 1; next <= AHEAD; next++) if (now + next < frames.length) stage.ready(now + next);
  }

  // The values at a frame as a small table: measured and predicted side by side.
  function readout(frame) {
    const per = (P) => (data.P0 && P !== null ? ` (${fixed(P / data.P0, 2)} P\u2080)` : "");
    const lines = [
      ["Force, N", withStd(frame.P, frame.s, 2) + per(frame.P), fixed(frame.Q, 2) + per(frame.Q)],
      ["Band", fixed(frame.i, 0), fixed(frame.j, 0)],
      ["\u03b2, \u00b0", withStd(frame.b, frame.bs, 1), fixed(frame.c, 2)],
    ];
    const cell = (tag, text, kind = "") => { const made = document.createElement(tag); made.textContent = text; if (kind) made.className = kind; return made; };
    const row = (...cells) => { const made = document.createElement("tr"); made.append(...cells); return made; };
    const head = document.createElement("p"), travel = frame.u === null ? "\u2013" : `${fixed(frame.u, 2)} mm`;
    head.append(cell("b", `Frame ${frame.n}`), ` of ${frames.at(-1).n}, u = ${travel}` + (data.depth && frame.u !== null ? ` = ${fixed(frame.u / data.depth, 2)} d` : ""));
    const table = document.createElement("table"), top = document.createElement("thead"), body = document.createElement("tbody");
    top.append(row(cell("td", ""), cell("th", "measured", "measured"), cell("th", "predicted", "predicted")));
    body.append(...lines.map(([name, measured, predicted]) => row(cell("th", name), cell("td", measured), cell("td", predicted))));
    table.append(top, body);
    return [head, table];
  }

  function play() {
    if (timer) return pause();
    const at = stops.findIndex((k) => k > now);
    if (at < 0) show(stops[0]);
    face(true);
    step();
  }

  function step() {
    timer = window.setTimeout(() => {
      const next = stops.find((k) => k > now);
      if (next === undefined) return pause();
      show(next);
      if (next === stops.at(-1)) pause(); else step();
    }, 1000 / Number(part("speed").value));
  }

  function pause() {
    window.clearTimeout(timer);
    timer = 0;
    face(false);
  }

  function face(playing) {
    const button = part("play");
    button.setAttribute("aria-label", playing ? "Pause" : "Play");
    button.querySelector("path").setAttribute("d", playing ? PAUSE : PLAY);
  }

  function go(k) { pause(); show(k); }

  function nearest(u) {
    let best = now, least = Infinity;
    frames.forEach((frame, k) => {
      if (frame.u !== null && Math.abs(frame.u - u) < least) { least = Math.abs(frame.u - u); best = k; }
    });
    return best;
  }

  slider.addEventListener("input", () => go(Number(slider.value)));
  for (const control of [slider, part("play")]) control.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
    if (by) go(now + by * (event.shiftKey && Math.abs(by) === 1 ? 10 : 1));
    else if (event.key === "Home") go(0);
    else if (event.key === "End") go(frames.length - 1);
    else if (event.key === " " && control === slider) play();
    else return;
    event.preventDefault();
  });
  part("play").addEventListener("click", play);

  // A pointer pressed on the force goes to the travel under it; dragged across the stage it winds.
  drag(part("force"), (event) => go(nearest(chart.under(event))), true);
  let from = 0, held = 0;
  drag(part("stage"), (event, first) => {
    if (first) { from = event.clientX; held = now; return; }
    const frame = part("stage").getBoundingClientRect().width / Math.min(60, Math.max(10, frames.length));
    go(held + Math.round((event.clientX - from) / frame));
  });

  function drag(element, act) {
    if (!element) return;
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      element.setPointerCapture(event.pointerId);
      slider.focus({ preventScroll: true });
      act(event, true);
    });
    element.addEventListener("pointermove", (event) => { if (element.hasPointerCapture(event.pointerId)) act(event, false); });
  }

  for (const box of room.querySelectorAll("[data-player^=toggle-]")) {
    const name = box.dataset.player.slice("toggle-".length);
    const apply = () => { stage.shown[name] = box.checked; };
    apply();
    box.addEventListener("change", () => { apply(); show(now); });
  }
  part("dots")?.addEventListener("change", (event) => { stage.dots = event.target.value; scale(); show(now); });

  // What the colours of the points stand for.
  function scale() {
    const bar = part("scale"), top = { motion: data.dots.motion, shear: data.dots.shear }[stage.dots];
    bar.hidden = !top;
    if (!top) return;
    const words = stage.dots === "motion" ? "mm for a millimetre of the blade" : `maximum shear strain over ${data.dots.gauge} mm`;
    const swatches = svg("svg", { viewBox: `0 0 ${COLOURS.length * 14} 10`, width: COLOURS.length * 14, height: 10, "aria-hidden": "true" },
      ...COLOURS.map((fill, k) => svg("rect", { x: 14 * k, width: 14, height: 10, fill })));
    bar.replaceChildren("0 ", swatches, ` ${minus(top)} and more, ${words}`);
  }

  const named = () => `frame-${String(frames[now].n).padStart(4, "0")}`;
  // The photograph is waited for first: until it is decoded the stage holds the one before.
  part("save-svg").addEventListener("click", async () => {
    pause();
    const k = now, jpeg = await asJpeg(k), address = stage.address(k);
    if (now !== k) show(k);
    const text = svgText(part("stage"));
    save(`${named()}.svg`, "image/svg+xml", jpeg ? text.replace(address, jpeg) : text);
  });
  part("save-csv").addEventListener("click", () => save(`${named()}-lines.csv`, "text/csv", csv(lineRows())));
  part("save-force")?.addEventListener("click", () => save("force-history.csv", "text/csv", csv(forceRows())));

  // A photograph as every drawing program reads it; null without one.
  async function asJpeg(k) {
    const entry = stage.ready(k);
    await entry?.when;
    if (!entry?.picture.naturalWidth) return null;
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width: entry.picture.naturalWidth, height: entry.picture.naturalHeight });
    canvas.getContext("2d").drawImage(entry.picture, 0, 0);
    return canvas.toDataURL("image/jpeg", 0.9);
  }

  const short = (value, digits = 3) => Number(value.toFixed(digits));

  function lineRows() {
    const frame = frames[now], of = stage.of(now), found = [["frame", "u_mm", "what", "source", "layer_mm", "line", "x_mm", "y_mm"]];
    const add = (what, some, tagged) => some.forEach(({ tag, points }, line) => {
      const [source, height] = tagged ? data.tags[tag] : ["", null];
      for (const [x, y] of points) found.push([frame.n, frame.u, what, source, height, line, short(x), short(y)]);
    });
    const bands = (ends) => (frame.u === null ? [] : ends.map((end) => ({ points: [[frame.u, 0], end] })));
    add("layer, measured", of.measured, true);
    add("layer, predicted", of.predicted, true);
    add("surface, measured", of.surface, false);
    add("surface, predicted", of.above, false);
    add("band, measured", bands(of.bands), false);
    add("band, predicted", bands(of.modelBands), false);
    return found;
  }

  function forceRows() {
    const found = [["side", "u_mm", "force_N", "force_std_N"]], places = (step) => Math.max(0, -Math.round(Math.log10(step)));
    for (const [side, some, given] of [["measured", chart.measured, data.force.measured], ["predicted", chart.model, data.force.model]])
      for (const { u, values: [P, std = null] } of some)
        found.push([side, ...[u, P, std].map((value, k) => (value === null ? null : short(value, places(given.steps[k ? 1 : 0]))))]);
    return found;
  }

  if (matchMedia("(prefers-reduced-motion: reduce)").matches) part("speed").value = "2";
  new ResizeObserver(lay).observe(part("stage"));
  lay();
}

if (room) start();
