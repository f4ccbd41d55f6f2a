// The panels of one frame: predicted above, measured below over the photograph, on the same axes.
const { lines, shares, ticks, minus, svg } = window.ploughval.player;
const LEFT = 46, RIGHT = 8, TOP = 8, BOTTOM = 40, GAP = 10, TALLEST = 620, TAIL = 2;
const COLOURS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];

// Draws into the element `stage`; `shown` tells which layers are on, `dots` what the points show.
window.ploughval.player.Stage = class {
  constructor(stage, data, places) {
    Object.assign(this, { stage, data, places, shown: {}, dots: "tails", kept: new Map(), pictures: new Map() });
    this.still = stage.querySelector("image")?.getAttribute("href");
  }

  // Sizes and axes for a width in px.
  lay(width) {
    const [x0, x1, y0, y1] = this.data.view, panels = this.data.panels, room = width - LEFT - RIGHT;
    this.scale = Math.min(room / (x1 - x0), (TALLEST - GAP) / panels.length / (y1 - y0));
    this.left = LEFT + (room - this.scale * (x1 - x0)) / 2;
    this.width = this.scale * (x1 - x0);
    this.height = this.scale * (y1 - y0);
    const tall = TOP + panels.length * this.height + (panels.length - 1) * GAP + BOTTOM;
    this.stage.setAttribute("viewBox", `0 0 ${width} ${tall.toFixed(1)}`);
    this.stage.replaceChildren();
    this.layers = panels.map((name, k) => {
      const top = TOP + k * (this.height + GAP), id = `player-panel-${k}`;
      const box = { x: this.left, y: top, width: this.width, height: this.height };
      const drawn = svg("g", { "clip-path": ["url", "(#", id, ")"].join("") });
      this.stage.append(svg("clipPath", { id }, svg("rect", box)), drawn);
      this.axes(name, k, top, box);
      const note = svg("text", { class: "tag note", x: this.left + this.width - 8, y: top + 34, "text-anchor": "end" });
      this.stage.append(note);
      return { name, top, drawn, note };
    });
  }

  axes(name, k, top, box) {
    const [x0, x1, y0, y1] = this.data.view, bottom = top + this.height, right = this.left + this.width;
    const add = (text, attributes) => this.stage.append(svg("text", attributes, text));
    this.stage.append(svg("rect", { class: "edge", ...box }));
    for (const y of ticks(y0, y1, this.height < 170 ? 3 : 5))
      add(minus(y), { x: this.left - 6, y: top + (y1 - y) * this.scale + 4, "text-anchor": "end" });
    if (k === this.data.panels.length - 1) {
      for (const x of ticks(x0, x1, this.width < 420 ? 5 : 9))
        add(minus(x), { x: this.left + (x - x0) * this.scale, y: bottom + 15, "text-anchor": "middle" });
      add("x, mm", { x: (this.left + right) / 2, y: bottom + 33, "text-anchor": "middle" });
    }
    const at = [this.left - 34, (top + bottom) / 2];
    add("y, mm", { x: at[0], y: at[1], "text-anchor": "middle", transform: `rotate(-90 ${at.join(" ")})` });
    add(name, { class: "tag", x: right - 8, y: top + 18, "text-anchor": "end" });
  }

  // Places in mm as the text of a path.
  path(all, top, closed = "") {
    const [x0, , , y1] = this.data.view, s = this.scale;
    const at = ([x, y]) => `${(this.left + (x - x0) * s).toFixed(2)} ${(top + (y1 - y) * s).toFixed(2)}`;
    return all.map((points) => `M${points.map(at).join("L")}${closed}`).join("");
  }

  // Lines of a frame, unpacked once.
  of(k) {
    if (!this.kept.has(k)) {
      const frame = this.data.frames[k], t = this.data.tolerance;
      this.kept.set(k, {
        measured: lines(frame.L, t), predicted: lines(frame.M, t),
        surface: lines(frame.S, t), above: lines(frame.T, t), bands: frame.B ?? [], modelBands: frame.C ?? [],
      });
    }
    return this.kept.get(k);
  }

  show(k) {
    this.now = k;
    const frame = this.data.frames[k];
    this.stage.dataset.frame = frame.n;
    this.layers.forEach((panel, at) => {
      const predicted = panel.name === "predicted";
      const over = !predicted && this.on("photograph") && this.address(k) !== null;
      const groups = [
        over ? this.photograph(k, panel) : this.sand(k, panel, predicted),
        !predicted && this.on("tracks") && this.dots === "tails" && this.points(k, panel, over),
        this.on("layers-predicted") && this.layer("layers-predicted", this.of(k).predicted, panel, predicted ? "model" : "model thin", over),
        !predicted && this.on("layers-measured") && this.layer("layers-measured", this.of(k).measured, panel, "measured", over),
        !predicted && this.on("tracks") && this.dots !== "tails" && this.points(k, panel, over),
        this.on("surface") && this.surfaces(k, panel, predicted, over),
        this.on("bands") && this.bands(k, panel, predicted, over),
        this.on("blade") && this.blade(frame, panel, predicted, over),
      ];
      panel.drawn.replaceChildren(...groups.filter(Boolean));
      panel.note.textContent = this.words(frame, predicted, over, at);
    });
  }

  on(name) { return this.shown[name] !== false; }

  words(frame, predicted, over, at) {
    const travel = frame.u === null ? "u not known" : `u = ${minus(frame.u.toFixed(1))} mm` +
      (this.data.depth ? ` = ${minus((frame.u / this.data.depth).toFixed(2))} d` : "");
    if (this.height < 180) return frame.why ? "frame lost" : "";
    if (at === 0 && this.layers.length > 1) return travel;
    const lost = frame.why ? "frame lost" : !over && this.data.pictures && this.on("photograph") ? "no photograph" : "";
    return [this.layers.length > 1 ? "" : travel, lost].filter(Boolean).join(", ");
  }

  // A path, with a light one below it where it lies over the photograph.
  line(all, top, kind, over) {
    const d = this.path(all, top);
    if (!d) return [];
    const path = svg("path", { class: over ? `${kind} over` : kind, d });
    return over ? [svg("path", { class: `halo ${kind}`, d }), path] : [path];
  }

  layer(name, drawn, panel, kind, over) {
    const dyed = drawn.filter((line) => this.data.tags[line.tag][0] === "dye");
    const plain = drawn.filter((line) => this.data.tags[line.tag][0] !== "dye");
    const pairs = [dyed, plain].map((some, k) => this.line(some.map((one) => one.points), panel.top, k ? kind : `${kind} dyed`, over));
    const parts = over ? [...pairs.map((pair) => pair[0]), ...pairs.map((pair) => pair[1])].filter(Boolean) : pairs.flat();
    return parts.length ? svg("g", { "data-layer": name }, ...parts) : null;
  }

  surfaces(k, panel, predicted, over) {
    const { surface, above } = this.of(k), points = (some) => some.map((line) => line.points);
    const own = this.line(points(predicted ? above : surface), panel.top, "ground", over);
    const other = predicted ? [] : this.line(points(above), panel.top, "ground model thin", over);
    return own.length + other.length ? svg("g", { "data-layer": "surface" }, ...other, ...own) : null;
  }

  bands(k, panel, predicted, over) {
    const u = this.data.frames[k].u, { bands, modelBands } = this.of(k);
    if (u === null) return null;
    const tip = (ends) => ends.map((end) => [[u, 0], end]);
    const parts = this.line(tip(modelBands), panel.top, "band model", over);
    if (!predicted) parts.push(...this.line(tip(bands), panel.top, "band measured", over));
    return parts.length ? svg("g", { "data-layer": "bands" }, ...parts) : null;
  }

  blade(frame, panel, predicted, over) {
    const face = predicted ? frame.u : frame.x ?? frame.u, [x0, , , y1] = this.data.view, s = this.scale;
    if (face === null) return null;
    return svg("g", { "data-layer": "blade" }, svg("rect", {
      class: over ? "blade over" : "blade", x: this.left + (face - this.data.thickness - x0) * s, y: panel.top,
      width: this.data.thickness * s, height: y1 * s,
    }));
  }

  sand(k, panel, predicted) {
    const low = this.data.view[2] - 1, { surface, above } = this.of(k);
    const shapes = (predicted ? above : surface.length ? surface : above).map((line) => line.points).filter((points) => points.length > 1)
      .map((points) => [...points, [points.at(-1)[0], low], [points[0][0], low]]);
    return shapes.length ? svg("g", { "data-layer": "sand" }, svg("path", { class: "sand", d: this.path(shapes, panel.top, "z") })) : null;
  }

  // Dots with tails over the frames before, or coloured by classes of what moved or sheared.
  points(k, panel, over) {
    if (!this.places[k]) return null;
    // On a phone every third dot: more would hide the picture.
    const places = this.width < 420 ? this.places[k].map((place, i) => (i % 3 ? null : place)) : this.places[k];
    const group = svg("g", { "data-layer": "tracks" });
    const dot = (some) => this.path(some.map((place) => [place, place]), panel.top);
    if (this.dots === "tails") {
      const tails = places.map((place, i) => {
        const tail = place ? [place] : [];
        for (let b = k - 1; place && b >= 0 && b >= k - TAIL && this.places[b]?.[i]; b--) tail.push(this.places[b][i]);
        return tail;
      }).filter((tail) => tail.length > 1);
      group.append(svg("path", { class: over ? "tail over" : "tail", d: this.path(tails, panel.top) }));
      const all = dot(places.filter(Boolean));
      if (over) group.append(svg("path", { class: "dot rim", d: all }));
      group.append(svg("path", { class: over ? "dot over" : "dot", d: all }));
      return group;
    }
    const values = shares(this.data.frames[k][this.dots === "motion" ? "m" : "g"]);
    const classes = COLOURS.map(() => []), unknown = [];
    places.forEach((place, i) => {
      if (!place) return;
      const value = values[i] ?? null;
      (value === null ? unknown : classes[Math.min(COLOURS.length - 1, Math.floor(value * COLOURS.length))]).push(place);
    });
    if (unknown.length) group.append(svg("path", { class: "dot unknown", d: dot(unknown) }));
    classes.forEach((some, c) => { if (some.length) group.append(svg("path", { class: "dot large", style: `stroke: ${COLOURS[c]}`, d: dot(some) })); });
    return group;
  }

  // The photograph's address, null without one.
  address(k) {
    if (!this.data.pictures) return null;
    if (k === this.data.still && this.still) return this.still;
    const bytes = this.data.frames[k].p;
    return bytes ? `data:${this.data.pictures.kind};base64,${bytes}` : null;
  }

  // The picture of a frame, decoded ahead so that it can be put up at once.
  ready(k) {
    const address = this.address(k);
    if (address === null || this.pictures.has(k)) return this.pictures.get(k);
    const picture = new Image();
    picture.src = address;
    const entry = { picture, done: false };
    entry.when = picture.decode().then(() => { entry.done = true; }, () => { entry.done = true; });
    this.pictures.set(k, entry);
    return entry;
  }

  photograph(k, panel) {
    const [x0, x1, y0, y1] = this.data.pictures.extent, view = this.data.view, s = this.scale;
    const entry = this.ready(k), before = entry.done ? null : this.up ?? null;
    const image = svg("image", {
      x: this.left + (x0 - view[0]) * s, y: panel.top + (view[3] - y1) * s, width: (x1 - x0) * s, height: (y1 - y0) * s,
      preserveAspectRatio: "none", href: before ?? this.address(k),
    });
    // Until it is decoded the one before stays up: no blank between two frames.
    if (before !== null) entry.when.then(() => image.setAttribute("href", this.address(k)));
    this.up = this.address(k);
    return svg("g", { "data-layer": "photograph" }, image);
  }
};
window.ploughval.player.COLOURS = COLOURS;
