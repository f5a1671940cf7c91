// The grading curve: percent finer over the logarithm of the size, target and reached, as SVG.

import { say } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";

function element(name, attributes = {}, text = "") {
  const e = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  e.textContent = text;
  return e;
}

/** Draw into `place`. classes: [{ size [mm], target [%], reached [%] }], large to small. */
export function drawCurve(place, classes, coarseLeft) {
  const { width, height } = place.getBoundingClientRect();
  const [w, h] = [Math.max(260, width), Math.max(200, height)];
  const [left, right, top, bottom] = [52, w - 14, 10, h - 44];
  const sizes = classes.map((c) => c.size);
  const [low, high] = span(Math.min(...sizes), Math.max(...sizes));
  const along = (d) => (Math.log10(d) - low) / (high - low);
  const x = (d) => left + (right - left) * (coarseLeft ? 1 - along(d) : along(d));
  const y = (p) => bottom - ((bottom - top) * p) / 100;
  const svg = element("svg", { viewBox: `0 0 ${w} ${h}`, role: "img", "aria-label": say("plot_label") });

  for (const { size, major } of ticks(low, high)) {
    svg.append(element("line", { x1: x(size), x2: x(size), y1: top, y2: bottom, class: major ? "major" : "minor" }));
  }
  for (const size of labelled(low, high)) {
    svg.append(element("text", { x: x(size), y: bottom + 16, "text-anchor": "middle" }, String(Number(size.toPrecision(2)))));
  }
  for (let p = 0; p <= 100; p += 20) {
    svg.append(element("line", { x1: left, x2: right, y1: y(p), y2: y(p), class: "major" }));
    svg.append(element("text", { x: left - 7, y: y(p) + 4, "text-anchor": "end" }, String(p)));
  }
  svg.append(element("rect", { x: left, y: top, width: right - left, height: bottom - top, class: "axis" }));
  svg.append(element("text", { x: (left + right) / 2, y: h - 8, "text-anchor": "middle", class: "name" }, say("x_axis")));
  svg.append(element("text", {
    x: 0, y: 0, "text-anchor": "middle", class: "name", transform: `translate(14 ${(top + bottom) / 2}) rotate(-90)`,
  }, say("y_axis")));

  for (const which of ["target", "reached"]) {
    const points = classes.filter((c) => Number.isFinite(c[which])).map((c) => [x(c.size), y(c[which])]);
    svg.append(element("polyline", { points: points.map((p) => p.join(",")).join(" "), class: which }));
    classes.forEach((c, k) => {
      if (!points[k]) return;
      const mark = which === "target"
        ? element("circle", { cx: points[k][0], cy: points[k][1], r: 4, class: "target-mark" })
        : element("rect", { x: points[k][0] - 3.2, y: points[k][1] - 3.2, width: 6.4, height: 6.4, class: "reached-mark" });
      mark.append(element("title", {}, `${c.size} mm: ${Number(c[which].toFixed(2))} %`));
      svg.append(mark);
    });
  }
  legend(svg, coarseLeft ? right - 108 : left + 12, top + 10);
  place.replaceChildren(svg);
}

function legend(svg, x, y) {
  svg.append(element("rect", { x, y, width: 98, height: 44, rx: 6, class: "legend" }));
  svg.append(element("line", { x1: x + 8, x2: x + 34, y1: y + 15, y2: y + 15, class: "target" }));
  svg.append(element("circle", { cx: x + 21, cy: y + 15, r: 4, class: "target-mark" }));
  svg.append(element("line", { x1: x + 8, x2: x + 34, y1: y + 31, y2: y + 31, class: "reached" }));
  svg.append(element("rect", { x: x + 17.8, y: y + 27.8, width: 6.4, height: 6.4, class: "reached-mark" }));
  svg.append(element("text", { x: x + 42, y: y + 19, class: "name" }, say("target")));
  svg.append(element("text", { x: x + 42, y: y + 35, class: "name" }, say("achieved")));
}

// Ends of the axis [decades]: 1, 2 or 5 times a power of ten, with a little room beside the outermost marks.
function span(least, most) {
  const room = Math.max(0.06, 0.04 * Math.log10(most / least));
  const [from, to] = [Math.log10(least) - room, Math.log10(most) + room];
  const round = [];
  for (let decade = Math.floor(from); decade <= Math.ceil(to); decade++) {
    for (const n of [1, 2, 5]) round.push(decade + Math.log10(n));
  }
  return [Math.max(...round.filter((p) => p <= from)), Math.min(...round.filter((p) => p >= to))];
}

function* ticks(low, high) {
  for (let decade = Math.floor(low); decade <= high; decade++) {
    for (let n = 1; n < 10; n++) {
      const place = decade + Math.log10(n);
      if (place >= low - 1e-9 && place <= high + 1e-9) yield { size: 10 ** place, major: n === 1 };
    }
  }
}

// Powers of ten, and 2 and 5 times these where there is room.
function* labelled(low, high) {
  for (const { size } of ticks(low, high)) {
    const n = Math.round(size / 10 ** Math.floor(Math.log10(size) + 1e-9));
    if (n === 1 || (high - low < 3.2 && (n === 2 || n === 5))) yield size;
  }
}
