// What the tests ask of a page, added to it before its own scripts run.
window.checks = {
  violations: [],

  // Elements of a page (outside figures and scrolling tables) that reach beyond the window's right edge.
  beyondTheEdge() {
    return [...document.body.querySelectorAll("*")]
      .filter((e) => !e.closest("svg *, .scroll *") && e.checkVisibility())
      .filter((e) => e.getBoundingClientRect().right > innerWidth + 0.5)
      .map((e) => e.outerHTML.slice(0, 90));
  },

  // Contrast (WCAG 2.2) of every kind of text outside figures against the ground it stands on.
  contrasts() {
    const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    const rgb = (colour) => {
      canvas.clearRect(0, 0, 1, 1);
      canvas.fillStyle = colour;
      canvas.fillRect(0, 0, 1, 1);
      return canvas.getImageData(0, 0, 1, 1).data;
    };
    const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    const light = (c) => 0.2126 * linear(c[0] / 255) + 0.7152 * linear(c[1] / 255) + 0.0722 * linear(c[2] / 255);
    const ground = (element) => {
      for (let at = element; at; at = at.parentElement) {
        const c = rgb(getComputedStyle(at).backgroundColor);
        if (c[3] === 255) return c;
      }
      return rgb("#fff");
    };
    const found = new Map();
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
      const element = node.parentElement;
      if (!node.data.trim() || element.closest("script, style, svg, noscript")) continue;
      if (!element.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
      const style = getComputedStyle(element);
      const [a, b] = [light(rgb(style.color)), light(ground(element))].sort((x, y) => y - x);
      const size = parseFloat(style.fontSize);
      const key = [style.color, size, style.fontWeight, ground(element)].join();
      if (found.has(key)) continue;
      const text = node.data.trim().slice(0, 40);
      found.set(key, { contrast: (a + 0.05) / (b + 0.05), size, weight: +style.fontWeight, text });
    }
    return [...found.values()];
  },

  // Numbers every element that the Tab key should reach, in the order of the page; returns how many.
  seats() {
    let count = 0;
    for (const e of document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex]")) {
      if (e.tabIndex < 0 || e.disabled || !e.checkVisibility({ visibilityProperty: true })) continue;
      e.dataset.seat = ++count;
    }
    return count;
  },

  // The element that has the focus: its number, and whether one sees that it has it.
  focused() {
    const e = document.activeElement;
    const style = getComputedStyle(e);
    const box = e.getBoundingClientRect();
    const ringed = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) > 0;
    const shown = box.width > 0 && box.height > 0 && +style.opacity > 0.5;
    return { seat: +e.dataset.seat, seen: shown && (ringed || style.boxShadow !== "none"), html: e.outerHTML.slice(0, 90) };
  },

  // The name that a reader of the screen says; empty where there is none.
  name(e) {
    const byIds = (e.getAttribute("aria-labelledby") || "").split(/\s+/).map((id) => document.getElementById(id));
    const labels = [...(e.labels || [])];
    const parts = [e.ariaLabel, e.alt, ...byIds.map((p) => p && p.textContent), ...labels.map((p) => p.textContent)];
    if (e.matches("a, button, summary")) parts.push(e.textContent);
    return parts.filter(Boolean).join(" ").trim();
  },

  namelessPictures() {
    return [...document.querySelectorAll("svg, img, canvas")]
      .filter((e) => !e.closest("[aria-hidden=true]") && !e.parentElement.closest("svg"))
      .filter((e) => !checks.name(e) || (e.tagName !== "IMG" && e.getAttribute("role") !== "img"))
      .map((e) => e.outerHTML.slice(0, 120));
  },

  namelessControls() {
    return [...document.querySelectorAll("button, input, select, a[href], summary, [role=region]")]
      .filter((e) => !checks.name(e))
      .map((e) => e.outerHTML.slice(0, 120));
  },

  doubledIds() {
    const ids = [...document.querySelectorAll("[id]")].map((e) => e.id);
    return ids.filter((id, k) => ids.indexOf(id) !== k);
  },

  visible(selector) {
    return [...document.querySelectorAll(selector)]
      .filter((e) => e.checkVisibility({ visibilityProperty: true }))
      .map((e) => e.outerHTML.slice(0, 90));
  },
};
document.addEventListener("securitypolicyviolation", (e) => checks.violations.push(e.violatedDirective));

// What a reader of a drawing reads off it: numbers and places of texts, and the corners of paths.
checks.number = (text) => (/^[-\u2212]?[\d.]+$/.test(text.trim()) ? Number(text.trim().replace("\u2212", "-")) : null);

checks.texts = (svg, selector = "text") => [...svg.querySelectorAll(selector)].map((e) => ({
  value: checks.number(e.textContent), x: +e.getAttribute("x"), y: +e.getAttribute("y"), anchor: e.getAttribute("text-anchor"),
}));

checks.paths = (svg, selector) => [...svg.querySelectorAll(selector)].flatMap((path) =>
  path.getAttribute("d").split("M").filter(Boolean).map((piece) => piece.replace("z", "").split("L").map((p) => p.trim().split(/[ ,]+/).map(Number))));
