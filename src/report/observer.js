// SPDX-License-Identifier: Apache-2.0
// Draws the observer's report from the JSON in #data.
"use strict";
(() => {
function writeTop() {
  byId("title").textContent = data.title || "Observer without a title";
  document.title = (data.title ? data.title + " \u2013 " : "") + "trammel observer report";
  byId("status").textContent = `${data.runs} flights, seed ${data.seed}.`;
  const n = data.numbers, cards = byId("cards");
  cards.append(card("Spread of the error in x", n.sd_error, "m", `standard deviation; mean ${number(n.mean_error)} m`, true));
  cards.append(card("Stated by the filter", n.rms_predicted, "m", "root of the mean predicted variance"));
  cards.append(card("Miss", n.miss_mean, "m", `from the goal; sd ${number(n.miss_sd)} m`));
  cards.append(card("Effort", n.effort_mean, "m", `total lateral travel; sd ${number(n.effort_sd)} m`));
  cards.append(card("Median normalised squared error", n.median_nees, "", "2.37 when the filter is consistent"));
  byId("meaning").textContent = data.meaning;
  const table = element("table");
  for (const [name, value] of data.facts) {
    table.append(element("tr", {}, element("th", {}, name), element("td", {}, value)));
  }
  byId("facts").append(table);
}

const colours = ["--estimate", "--gauss", "--second", "--third", "--nominal"];

/// One projection of the sample paths: flights share the abscissa only if they are sorted along it.
function drawProjection(box, a, b, names) {
  const width = Math.max(320, box.clientWidth), left = 66, bottom = 44, top = 8, right = 12, high = 280;
  const flights = data.paths;
  const range = k => {
    const all = flights.flatMap(f => f[k]);
    const low = Math.min(...all), up = Math.max(...all), slack = 0.05 * Math.max(up - low, 1e-9);
    return [low - slack, up + slack];
  };
  const [x0, x1] = range(a), [y0, y1] = range(b);
  const px = x => left + (x - x0) / (x1 - x0) * (width - left - right);
  const py = y => top + (y1 - y) / (y1 - y0) * high;
  const svg = element("svg", {width, height: high + top + bottom, role: "img", "aria-label": `${names[1]} against ${names[0]}`});
  for (const x of ticks(x0, x1, 7)) {
    svg.append(element("line", {x1: px(x), x2: px(x), y1: top, y2: top + high, stroke: css("--grid")}),
      element("text", {x: px(x), y: top + high + 17, "text-anchor": "middle"}, number(x, 6)));
  }
  for (const y of ticks(y0, y1, 5)) {
    svg.append(element("line", {x1: left, x2: width - right, y1: py(y), y2: py(y), stroke: css("--grid")}),
      element("text", {x: left - 8, y: py(y) + 4, "text-anchor": "end"}, number(y, 6)));
  }
  svg.append(element("text", {x: (left + width) / 2, y: top + high + 38, "text-anchor": "middle"}, names[0] + " (m)"),
    element("text", {transform: `translate(14 ${top + high / 2}) rotate(-90)`, "text-anchor": "middle"}, names[1] + " (m)"));
  flights.forEach((f, i) => {
    const d = f[a].map((x, k) => (k ? "L" : "M") + px(x).toFixed(2) + " " + py(f[b][k]).toFixed(2)).join("");
    svg.append(element("path", {d, fill: "none", stroke: css(colours[i % colours.length]), "stroke-width": 1.4, opacity: 0.8,
      "data-curve": names.join("") + i}));
    svg.append(element("circle", {cx: px(f[a][0]), cy: py(f[b][0]), r: 3, fill: css(colours[i % colours.length])}));
  });
  svg.append(element("rect", {x: left, y: top, width: width - left - right, height: high, fill: "none", stroke: css("--line")}));
  box.replaceChildren(legend([{label: "one flight each, dot: start", stroke: css("--estimate"), width: 1.4}]), svg);
}

const fromZero = (_, low, high) => [0, high > 0 ? 1.08 * high : 1];

function drawSpread(box) {
  plot(box, {x: data.spread.t, yLabel: "metres", height: 300, yRange: fromZero, series: [
    {label: "standard deviation of the error", stroke: css("--estimate"), width: 2.4, values: data.spread.sd},
    {label: "stated by the filter", stroke: css("--gauss"), width: 1.8, dash: [7, 4], values: data.spread.predicted},
  ]});
}

function drawHistogram(box, h, label) {
  const series = [{label, stroke: css("--estimate"), fill: css("--band"), width: 1.5, values: h.share,
    paths: uPlot.paths.bars({size: [1, Infinity]})}];
  if (h.normal) series.push({label: "normal", stroke: css("--gauss"), width: 1.6, dash: [5, 4], values: h.normal});
  if (h.chi2) series.push({label: "chi-squared", stroke: css("--gauss"), width: 1.6, dash: [5, 4], values: h.chi2});
  plot(box, {x: h.centre, yLabel: "share of runs", xLabel: label, height: 220, yRange: fromZero, series});
}

startPage(writeTop, () => {
  drawProjection(byId("path-xy"), "x", "y", ["x", "y"]);
  drawProjection(byId("path-xz"), "x", "z", ["x", "z"]);
  drawProjection(byId("path-yz"), "y", "z", ["y", "z"]);
  drawSpread(byId("spread"));
  drawHistogram(byId("hist-error"), data.histograms.error, "error (m)");
  drawHistogram(byId("hist-miss"), data.histograms.miss, "miss (m)");
  drawHistogram(byId("hist-effort"), data.histograms.effort, "effort (m)");
  drawHistogram(byId("hist-nees"), data.histograms.nees, "nees");
});
})();
