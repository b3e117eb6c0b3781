// The hemisphere of virtual cameras from above, in Lambert's equal-area projection.
const RIM = 200; // radius of the horizon, units of the drawing
const SVG = "http://www.w3.org/2000/svg";
// Viridis, which readers with any colour vision can order from dark to light.
const SCALE = ["#440154", "#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"]
  .map((one) => [1, 3, 5].map((k) => parseInt(one.slice(k, k + 2), 16)));
const LOG_RATIO = 5; // of the ends of a range; above it, equal steps of colour are equal ratios
const UNKNOWN_COLOUR = [150, 150, 150];

function scaleColour(share) {
  if (!Number.isFinite(share)) return UNKNOWN_COLOUR;
  const place = Math.min(Math.max(share, 0), 1) * (SCALE.length - 1);
  const k = Math.min(Math.floor(place), SCALE.length - 2);
  return SCALE[k].map((low, i) => Math.round(low + (place - k) * (SCALE[k + 1][i] - low)));
}

const css = (colour) => `rgb(${colour.join(",")})`;

function drawing(name, attributes = {}, text = "") {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

function onMap(u) {
  const flat = Math.hypot(u[0], u[1]) || 1, out = RIM * Math.sqrt(Math.max(1 - u[2], 0)) / flat;
  return [u[0] * out, -u[1] * out];
}

// The range that colours cover: without the outermost hundredth at each end.
function rangeOf(values) {
  const known = [...values].filter(Number.isFinite).sort((a, b) => a - b);
  const at = (share) => known[Math.round(share * (known.length - 1))];
  return { low: at(0.01), high: at(0.99), least: known[0], most: known[known.length - 1], middle: at(0.5), known: known.length };
}

class HemisphereMap {
  // views: [{ u, mirrors }]; chosen is called with the number of a view.
  constructor(place, views, chosen) {
    Object.assign(this, { place, views, chosen, current: -1 });
    this.points = views.map((view) => onMap(view.u));
    const size = Math.min(0.84 * RIM / Math.sqrt(views.length), 14);
    this.svg = drawing("svg", {
      viewBox: "-222 -222 444 506", tabindex: 0, role: "group",
      "aria-label": "Map of the virtual cameras. Arrow keys go from one to the next.",
    });
    this.svg.append(drawing("circle", { class: "frame", r: RIM }));
    this.dots = this.points.map(([x, y], k) => {
      const dot = drawing("circle", { class: "view", cx: x.toFixed(2), cy: y.toFixed(2), r: size.toFixed(2), "data-view": k });
      this.svg.append(dot);
      return dot;
    });
    this.ring = drawing("circle", { class: "chosen", r: size + 2.5, visibility: "hidden" });
    this.legend = drawing("g", { transform: "translate(-200, 222)" });
    this.svg.append(this.ring, this.legend, ...this.words());
    place.append(this.svg);
    this.svg.addEventListener("click", (event) => this.clicked(event));
    this.svg.addEventListener("keydown", (event) => this.typed(event));
  }

  words() {
    const word = (x, text) => drawing("text", { x, y: -208, class: "soft", "text-anchor": x < 0 ? "start" : "end" }, text);
    return [word(-215, "camera b (x < 0)"), word(215, "camera a (x > 0)")];
  }

  // Nearest dot, so that a click between small dots counts too.
  clicked(event) {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    const far = this.points.map(([x, y]) => Math.hypot(x - at.x, y - at.y));
    const nearest = far.indexOf(Math.min(...far));
    if (far[nearest] < 12) this.chosen(nearest);
  }

  typed(event) {
    const ways = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const way = ways[event.key];
    if (!way) return;
    event.preventDefault();
    this.chosen(this.current < 0 ? 0 : this.next(way));
  }

  // The nearest view in a direction: what lies aside counts as farther.
  next([dx, dy]) {
    const [x, y] = this.points[this.current];
    let best = this.current, least = Infinity;
    this.points.forEach(([px, py], k) => {
      const along = (px - x) * dx + (py - y) * dy, aside = Math.abs((px - x) * dy - (py - y) * dx);
      if (along < 1e-6 || along + 3 * aside >= least) return;
      [best, least] = [k, along + 3 * aside];
    });
    return best;
  }

  choose(k) {
    this.current = k;
    this.ring.setAttribute("visibility", k < 0 ? "hidden" : "visible");
    if (k < 0) return;
    this.ring.setAttribute("cx", this.points[k][0]);
    this.ring.setAttribute("cy", this.points[k][1]);
  }

  // quantity: { label, unit, digits, values (one a view) }; smaller than `least` is marked.
  show(quantity, least) {
    const range = rangeOf(quantity.values);
    range.log = range.low > 0 && range.high > LOG_RATIO * range.low;
    const [place, low, high] = range.log ? [Math.log, Math.log(range.low), Math.log(range.high)] : [Number, range.low, range.high];
    this.colour = (value) => scaleColour(high > low ? (place(value) - low) / (high - low) : value - low);
    let short = 0;
    this.dots.forEach((dot, k) => {
      const below = quantity.values[k] < least;
      short += below;
      dot.setAttribute("fill", css(this.colour(quantity.values[k])));
      dot.classList.toggle("short", below);
    });
    this.showLegend(quantity, range, short, least);
  }

  showLegend(quantity, range, short, least) {
    const text = (value) => `${value.toFixed(quantity.digits)} ${quantity.unit}`.trim();
    const bar = Array.from({ length: 50 }, (_, k) =>
      drawing("rect", { x: 8 * k, y: 6, width: 8.5, height: 12, fill: css(scaleColour(k / 49)) }));
    const below = least > 0 ? `; ${short} of ${range.known} below ${least} mm${short ? " (ringed)" : ""}` : "";
    this.legend.replaceChildren(
      drawing("text", { x: 0, y: 0 }, quantity.label + (range.log ? ", logarithmic scale" : "")),
      ...bar,
      drawing("text", { x: 0, y: 32 }, text(range.low)),
      drawing("text", { x: 400, y: 32, "text-anchor": "end" }, text(range.high)),
      drawing("text", { x: 0, y: 50, class: "soft" },
        `minimum ${text(range.least)}, median ${text(range.middle)}, maximum ${text(range.most)}${below}`),
    );
  }
}
