// Force against travel, P / P0 over u / d with mm and N on the other sides, and a cursor at the frame shown.
const { rows, ticks, minus, svg } = window.ploughval.player;
const LEFT = 44, RIGHT = 40, TOP = 40, BOTTOM = 38;

window.ploughval.player.Chart = class {
  constructor(chart, data) {
    Object.assign(this, { chart, data, measured: rows(data.force.measured), model: rows(data.force.model), envelope: rows(data.force.envelope) });
    const all = [...this.measured, ...this.model], us = [...all.map((row) => row.u), ...data.frames.map((frame) => frame.u)];
    const tops = [...all.map((row) => row.values[0]), ...this.envelope.map((row) => row.values[1])];
    const least = (some, start) => some.reduce((low, value) => (value !== null && value < low ? value : low), start);
    const most = (some, start) => some.reduce((high, value) => (value !== null && value > high ? value : high), start);
    this.uEnd = most(us, 1e-6);
    this.uStart = Math.min(0, least(us, 0) < -0.01 * this.uEnd ? least(us, 0) : 0);
    this.PEnd = 1.06 * most(tops, 1e-6);
    this.PStart = Math.min(0, least(all.map((row) => row.values[0]), 0) * 1.06);
    this.PStart = this.PStart < -0.02 * this.PEnd ? this.PStart : 0;
  }

  x(u) { return LEFT + (u - this.uStart) / (this.uEnd - this.uStart) * this.wide; }
  y(P) { return TOP + (this.PEnd - P) / (this.PEnd - this.PStart) * this.high; }
  u(x) { return this.uStart + (x - LEFT) / this.wide * (this.uEnd - this.uStart); }

  lay(width, height) {
    Object.assign(this, { wide: width - LEFT - RIGHT, high: height - TOP - BOTTOM });
    this.chart.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.chart.replaceChildren();
    this.axes(width, height);
    const clip = svg("clipPath", { id: "player-chart" }, svg("rect", { x: LEFT, y: TOP, width: this.wide, height: this.high }));
    const inside = svg("g", { "clip-path": ["url", "(#player-chart)"].join("") });
    inside.append(...this.shade(this.envelope, (row) => row.values, "shade model"));
    inside.append(...this.shade(this.measured, ({ values: [P, std] }) => [std === null ? null : P - 2 * std, std === null ? null : P + 2 * std], "shade measured"));
    const { lines, marks } = this.starts();
    inside.append(...lines);
    inside.append(svg("path", { class: "measured curve", d: this.line(this.measured) }), svg("path", { class: "model curve", d: this.line(this.model) }));
    this.cursor = svg("line", { class: "cursor", "data-player": "cursor", y1: TOP, y2: TOP + this.high });
    this.marks = [svg("circle", { class: "at measured", r: 6 }), svg("circle", { class: "at model", r: 3.5 })];
    this.chart.append(clip, inside, ...marks, ...this.peaks(), this.cursor, ...this.marks);
  }

  axes(width, height) {
    const { depth, P0 } = this.data, per = { u: depth || 1, P: P0 || 1 };
    const add = (text, x, y, anchor, extra = {}) => this.chart.append(svg("text", { x, y, "text-anchor": anchor, ...extra }, text));
    const many = Math.max(3, Math.floor(this.wide / 55)), few = Math.max(3, Math.floor(this.high / 34));
    for (const t of ticks(this.uStart / per.u, this.uEnd / per.u, many)) {
      this.chart.append(svg("line", { class: "grid", x1: this.x(t * per.u), x2: this.x(t * per.u), y1: TOP, y2: TOP + this.high }));
      add(minus(t), this.x(t * per.u), TOP + this.high + 15, "middle");
    }
    for (const t of ticks(this.PStart / per.P, this.PEnd / per.P, few)) {
      this.chart.append(svg("line", { class: "grid", x1: LEFT, x2: LEFT + this.wide, y1: this.y(t * per.P), y2: this.y(t * per.P) }));
      add(minus(t), LEFT - 6, this.y(t * per.P) + 4, "end");
    }
    add(depth ? "u / d" : "u, mm", LEFT + this.wide / 2, height - 5, "middle");
    add(P0 ? "P / P\u2080" : "P, N", 12, TOP + this.high / 2, "middle", { transform: `rotate(-90 12 ${TOP + this.high / 2})` });
    if (depth) {
      for (const t of ticks(this.uStart, this.uEnd, many)) add(minus(t), this.x(t), TOP - 6, "middle", { class: "second" });
      add("u, mm", LEFT + this.wide / 2, TOP - 24, "middle", { class: "second" });
    }
    if (P0) {
      for (const t of ticks(this.PStart, this.PEnd, few)) add(minus(t), LEFT + this.wide + 6, this.y(t) + 4, "start", { class: "second" });
      const at = [width - 5, TOP + this.high / 2];
      add("P, N", ...at, "middle", { class: "second", transform: `rotate(-90 ${at.join(" ")})` });
    }
    this.chart.append(svg("rect", { class: "edge", x: LEFT, y: TOP, width: this.wide, height: this.high }));
  }

  line(some) {
    let d = "", joined = false;
    for (const { first, u, values: [P] } of some) {
      if (u === null || P === null) { joined = false; continue; }
      d += `${first || !joined ? "M" : "L"}${this.x(u).toFixed(2)} ${this.y(P).toFixed(2)}`;
      joined = true;
    }
    return d;
  }

  // What lies between two curves, piece by piece.
  shade(some, ends, kind) {
    const pieces = [];
    let piece = null;
    for (const row of some) {
      const [low, high] = ends(row);
      if (low === null || high === null || row.u === null) { piece = null; continue; }
      if (!piece || row.first) pieces.push((piece = []));
      piece.push([this.x(row.u), this.y(low), this.y(high)]);
    }
    const d = pieces.filter((one) => one.length > 1).map((one) => {
      const top = one.map(([x, , high]) => `${x.toFixed(2)} ${high.toFixed(2)}`);
      const back = one.map(([x, low]) => `${x.toFixed(2)} ${low.toFixed(2)}`).reverse();
      return `M${[...top, ...back].join("L")}z`;
    }).join("");
    return d ? [svg("path", { class: kind, d })] : [];
  }

  // Starts of bands: triangles at the top for measured ones, at the bottom for predicted ones, whole at the edges.
  starts() {
    const { starts, modelStarts } = this.data.force, lines = [], marks = [];
    for (const [some, kind, y, tip] of [[starts, "measured", TOP, 9], [modelStarts, "model", TOP + this.high, -9]])
      for (const u of some) {
        const x = this.x(u);
        lines.push(svg("line", { class: `start ${kind}`, x1: x, x2: x, y1: TOP, y2: TOP + this.high }));
        marks.push(svg("path", { class: `mark ${kind}`, d: `M${x - 5} ${y}h10l-5 ${tip}z` }));
      }
    return { lines, marks };
  }

  peaks() {
    return this.data.force.peaks.map(([source, u, P]) =>
      svg("circle", { class: `peak ${source ? "model" : "measured"}`, cx: this.x(u), cy: this.y(P), r: 5 }));
  }

  show(frame) {
    const known = frame.u !== null;
    this.cursor.style.display = known ? "" : "none";
    if (known) for (const side of ["x1", "x2"]) this.cursor.setAttribute(side, this.x(frame.u).toFixed(2));
    [frame.P, frame.Q].forEach((P, k) => {
      this.marks[k].style.display = known && P !== null ? "" : "none";
      if (!known || P === null) return;
      this.marks[k].setAttribute("cx", this.x(frame.u).toFixed(2));
      this.marks[k].setAttribute("cy", this.y(P).toFixed(2));
    });
  }

  // Travel under a pointer.
  under(event) {
    const box = this.chart.getBoundingClientRect(), width = this.chart.viewBox.baseVal.width;
    return this.u((event.clientX - box.left) / box.width * width);
  }
};
