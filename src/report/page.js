// SPDX-License-Identifier: Apache-2.0
// Draws the report from the JSON in #data. No network, no state outside this page.
"use strict";
(() => {
// ---- text at the top --------------------------------------------------------------------------------

function writeTop() {
  byId("title").textContent = data.title || "Flight without a title";
  document.title = (data.title ? data.title + " \u2013 " : "") + "trammel report";
  byId("status").append(
    element("span", {class: "badge " + (data.status.solved ? "good" : "bad")}, data.status.name.replace("_", " ")),
    data.status.solved ? data.status.cause + "." : data.status.cause + ". What to do: " + data.status.remedy + ".");
  const n = data.numbers;
  const cards = byId("cards");
  const stated = data.statement;
  if (stated) {
    cards.append(card(stated.ambiguous ? "If solution 1 is true" : "Stated rms error",
      stated.ambiguous ? stated.conditional_rms : stated.stated_rms, "m", stated.ambiguous
        ? "no single value: the data are ambiguous"
        : "linear guarantee, curvature of the measurements and model error together", true));
  }
  cards.append(card(stated ? "Linear guarantee" : "Guaranteed rms error", n.guaranteed_rms, "m",
    "proved upper bound, for every motion within the bounds" + (stated ? ", measurements linearised" : ""), !stated));
  cards.append(card("Lower bound", n.lower_bound_rms, "m", "no linear estimator can guarantee less"));
  cards.append(card("Gauss\u2013Markov rms error", n.gauss_markov_rms, "m",
    n.gauss_markov_rms === "infinity" ? "measurements alone do not fix the motion" : "measurements alone, bounds not used"));
  cards.append(card("Bounds alone", n.prior_rms, "m", "rms error before any measurement"));
  if (isNumber(n.actual_rms)) {
    cards.append(card("Actual rms error", n.actual_rms, "m", "estimate against the true path given"));
  }
  byId("meaning").textContent = data.meaning;
  for (const text of data.warnings) byId("warnings").append(element("p", {class: "warning", role: "note"}, text));
  for (const text of data.assumptions) byId("assumptions").append(element("li", {}, text));
}

/// Where the stated error comes from, and the solutions when there are several.
function writeStatement() {
  const s = data.statement;
  const table = element("table", {class: "plain"});
  const row = cells => table.append(element("tr", {}, ...cells));
  const metres = value => isNumber(value) ? number(value) + " m" : "no bound";
  if (s.solutions.length > 0) {
    row(["solution", "its stated rms error", "rms distance from 1", "explains the data worse by"].map(t => element("th", {}, t)));
    row(["1", metres(s.conditional_rms), "", ""].map(t => element("td", {}, t)));
    s.solutions.forEach((other, k) => row([String(k + 2), metres(other.stated_rms), metres(other.distance),
      number(other.excess_cost, 3)].map(t => element("td", {}, t))));
    byId("statement-note").textContent = "Each error holds only if that solution is the true one. \u201cWorse by\u201d is the " +
      "difference of twice the log likelihood, bounds included; below 16 the data do not decide.";
  } else {
    const parts = [["linear guarantee", s.linear], ["curvature of the measurements", s.curvature], ["model error", s.model_error]];
    for (const [name, value] of parts) row([element("th", {}, name), element("td", {}, metres(value))]);
    row([element("th", {}, "stated"), element("td", {}, metres(s.stated_rms))]);
    byId("statement-note").textContent = {
      self_consistent: "Stated is where the sum settles when the tube around the path is widened by it: at least the sum of the parts.",
      curvature_dominated: "Stated is the sum of the parts. The curvature is too large for the tube around the path to confirm itself.",
      no_bound: "A remainder could not be bounded: nothing is stated.",
    }[s.consistency];
  }
  byId("statement").append(table);
}

// ---- curves -------------------------------------------------------------------------------------------

const styles = () => ({
  truth: {label: "true path", stroke: css("--truth"), width: 5, dash: []},
  estimate: {label: "guaranteed estimate", stroke: css("--estimate"), width: 2, dash: []},
  gauss_markov: {label: "Gauss\u2013Markov", stroke: css("--gauss"), width: 1.6, dash: [7, 4]},
  nominal: {label: "reference (nominal)", stroke: css("--nominal"), width: 1.5, dash: [2, 4]},
  ...Object.fromEntries((data.statement ? data.statement.solutions : []).map((_, k) => ["solution " + (k + 2),
    {label: "solution " + (k + 2), stroke: css("--second"), width: 1.6, dash: [10, 3, 2, 3]}])),
});
(data.statement ? data.statement.solutions : []).forEach((s, k) => {
  if (s.path) data.grid["solution " + (k + 2)] = s.path;
});
const paths = () => ["truth", "nominal", "gauss_markov", "estimate"].filter(name => data.grid[name])
  .concat(data.statement ? data.statement.solutions.map((_, k) => "solution " + (k + 2)).filter(name => data.grid[name]) : []);

function drawPlan(box) {
  const shown = paths();
  const xs = shown.flatMap(name => data.grid[name][0]), ys = shown.flatMap(name => data.grid[name][1]);
  const rms = data.grid.guaranteed_rms.filter(isNumber);
  const centre = data.grid.estimate ? "estimate" : "nominal";
  const reach = rms.length ? Math.max(...rms) : 0;
  let [x0, x1] = [Math.min(...xs) - reach, Math.max(...xs) + reach];
  let [y0, y1] = [Math.min(...ys) - reach, Math.max(...ys) + reach];
  const near = data.stations.filter(s => {   // stations not much farther away than the flight is wide
    const span = Math.max(x1 - x0, y1 - y0, 1);
    return s.position[0] > x0 - span && s.position[0] < x1 + span &&
      s.position[1] > y0 - span && s.position[1] < y1 + span;
  });
  for (const s of near) {
    x0 = Math.min(x0, s.position[0]); x1 = Math.max(x1, s.position[0]);
    y0 = Math.min(y0, s.position[1]); y1 = Math.max(y1, s.position[1]);
  }
  const margin = 0.06 * Math.max(x1 - x0, y1 - y0, 1);
  [x0, x1, y0, y1] = [x0 - margin, x1 + margin, y0 - margin, y1 + margin];
  const width = Math.max(320, box.clientWidth), left = 70, bottom = 46, top = 8, right = 12;
  const widest = width - left - right, highest = 640;
  const high = Math.min(highest, Math.max(300, widest * (y1 - y0) / (x1 - x0)));
  const room = Math.min(widest, Math.max(420, 1.3 * high * (x1 - x0) / (y1 - y0)));   // no empty sides
  const scale = Math.min(room / (x1 - x0), high / (y1 - y0));   // one scale: equal aspect
  const px = x => left + room / 2 + (x - (x0 + x1) / 2) * scale;
  const py = y => top + high / 2 - (y - (y0 + y1) / 2) * scale;
  const xlow = (x0 + x1) / 2 - room / 2 / scale, xhigh = (x0 + x1) / 2 + room / 2 / scale;
  const ylow = (y0 + y1) / 2 - high / 2 / scale, yhigh = (y0 + y1) / 2 + high / 2 / scale;
  const svg = element("svg", {width: left + room + right, height: high + top + bottom, role: "img", "aria-label": "Plan view of the flight"});
  svg.append(element("defs", {}, element("clipPath", {id: "frame"},
    element("rect", {x: left, y: top, width: room, height: high}))));
  const each = Math.max(3, Math.round(room / 110));
  const step = ticks(xlow, xhigh, each);
  const spacing = step.length > 1 ? step[1] - step[0] : 1;
  for (const x of step) {
    svg.append(element("line", {x1: px(x), x2: px(x), y1: top, y2: top + high, stroke: css("--grid")}),
      element("text", {x: px(x), y: top + high + 18, "text-anchor": "middle"}, number(x, 7)));
  }
  for (let i = Math.ceil(ylow / spacing); i * spacing <= yhigh; ++i) {
    const y = i * spacing;
    svg.append(element("line", {x1: left, x2: left + room, y1: py(y), y2: py(y), stroke: css("--grid")}),
      element("text", {x: left - 8, y: py(y) + 4, "text-anchor": "end"}, number(y, 7)));
  }
  svg.append(element("text", {x: left + room / 2, y: top + high + 40, "text-anchor": "middle"}, "x, east (m)"),
    element("text", {transform: `translate(14 ${top + high / 2}) rotate(-90)`, "text-anchor": "middle"}, "y, north (m)"));
  const inside = element("g", {"clip-path": "url(#frame)"});
  svg.append(inside);
  const curve = name => data.grid[name][0].map((x, i) => (i ? "L" : "M") + px(x).toFixed(2) + " " +
    py(data.grid[name][1][i]).toFixed(2)).join("");
  // The band: circles of the guaranteed rms around the path, drawn opaque and made transparent together.
  const opaque = css("--estimate");
  const band = element("g", {opacity: .22});
  const [cx, cy] = data.grid[centre];
  data.grid.guaranteed_rms.forEach((r, i) => {
    if (!isNumber(r)) return;
    if (i > 0) band.append(element("line", {x1: px(cx[i - 1]), y1: py(cy[i - 1]), x2: px(cx[i]), y2: py(cy[i]),
      stroke: opaque, "stroke-width": 2 * r * scale, "stroke-linecap": "round"}));
  });
  inside.append(band);
  for (const name of shown) {
    const s = styles()[name];
    inside.append(element("path", {d: curve(name), fill: "none", stroke: s.stroke, "stroke-width": s.width,
      "stroke-dasharray": s.dash.join(" "), "stroke-linejoin": "round", "data-curve": name}));
  }
  const first = data.grid[centre];
  inside.append(element("circle", {cx: px(first[0][0]), cy: py(first[1][0]), r: 4.5, fill: css("--paper"),
    stroke: css("--ink"), "stroke-width": 1.6}),
    element("text", {x: px(first[0][0]) - 9, y: py(first[1][0]) + 4, "text-anchor": "end"}, "start"));
  for (const s of near) {
    const [x, y] = [px(s.position[0]), py(s.position[1])];
    inside.append(element("path", {d: `M${x} ${y - 7}L${x + 6.5} ${y + 5}L${x - 6.5} ${y + 5}Z`, fill: css("--ink")}),
      element("text", {x: x + 10, y: y + 4}, s.name));
  }
  svg.append(element("rect", {x: left, y: top, width: room, height: high, fill: "none", stroke: css("--line")}));
  const far = data.stations.filter(s => !near.includes(s)).map(s => {
    const dx = s.position[0] - (x0 + x1) / 2, dy = s.position[1] - (y0 + y1) / 2;
    const names = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];
    const name = names[Math.round(((Math.atan2(dx, dy) / Math.PI + 2) % 2) * 4) % 8];
    return `${s.name} (${number(Math.hypot(dx, dy) / 1000, 3)} km ${name})`;
  });
  byId("plan-note").textContent = "Same scale in both directions. " +
    (rms.length ? "Shaded: the guaranteed rms error around the path, to scale. " : "") +
    (far.length ? "Outside the plot: " + far.join(", ") + "." : "");
  const rows = shown.map(name => styles()[name]);
  if (rms.length) rows.push({label: "guaranteed rms", fill: css("--band")});
  box.replaceChildren(legend(rows), svg);
}

// ---- plots over time --------------------------------------------------------------------------------

function drawHeight(box) {
  const g = data.grid, centre = (g.estimate || g.nominal)[2];
  const edge = sign => centre.map((z, i) => isNumber(g.guaranteed_rms[i]) ? z + sign * g.guaranteed_rms[i] : null);
  const none = {stroke: "transparent", width: 0, hidden: true};
  const series = [{...none, values: edge(1)}, {...none, values: edge(-1)}]
    .concat(paths().map(name => ({...styles()[name], values: g[name][2]})));
  plot(box, {x: data.grid.t, series, yLabel: "height z (m)", height: 300,
    bands: [{series: [1, 2], fill: css("--band"), legend: {label: "\u00b1 guaranteed rms", fill: css("--band")}}]});
  byId("height-note").textContent =
    "The band is the guaranteed rms of the whole position error; the height error alone is no larger in the mean square.";
}

const fromZero = (_, low, high) => [0, high > 0 ? 1.08 * high : 1];

function drawError(box) {
  const g = data.grid, s = styles();
  const series = [{...s.estimate, label: "guaranteed rms (proved at each time)", values: g.guaranteed_rms, width: 2.6}];
  let note = "Guaranteed rms error of the position at each time, for the same estimator. ";
  if (data.errors) {
    series.push({label: "actual error of the estimate", stroke: css("--ink"), width: 1.5, values: data.errors.estimate});
    if (data.errors.gauss_markov) {
      series.push({label: "actual error of Gauss\u2013Markov", stroke: s.gauss_markov.stroke, width: 1.5, dash: [7, 4],
        values: data.errors.gauss_markov});
    }
    note += "The guarantee is about the mean square over many measurement noises: a single actual error may " +
      "pass it at moments.";
  }
  byId("error-note").textContent = note;
  plot(box, {x: data.grid.t, series, yLabel: "position error (m)", yRange: fromZero});
}

function drawAcceleration(box) {
  const s = data.segments;
  const x = s.flatMap(e => [e.begin, e.end]);
  const steps = key => s.flatMap(e => [e[key], e[key]]);
  const series = [];
  if (s.some(e => isNumber(e.magnitude))) {
    series.push({label: "estimated deviation", stroke: css("--estimate"), fill: css("--band"), width: 2, values: steps("magnitude")});
  }
  series.push({label: "bound in the same direction", stroke: css("--gauss"), width: 2, dash: [7, 4], values: steps("limit")});
  byId("acceleration-note").textContent = "Deviation from the reference's acceleration, one constant vector per segment. " +
    "The estimator is linear, so an estimate may pass its bound a little; often and far means that a bound is too tight.";
  // Segment ends share a time; a tiny shift keeps the two values apart.
  for (let i = 2; i < x.length; i += 2) x[i] += 1e-9 * (x[x.length - 1] - x[0]);
  plot(box, {x, series, yLabel: "acceleration (m/s\u00b2)", yRange: fromZero});
}

function drawWorst(box) {
  const colours = ["--estimate", "--gauss", "--second"], dashes = [[], [7, 4], [2, 3]];
  const series = data.worst.map((values, i) => ({label: ["x (east)", "y (north)", "z (up)"][i] || "?", values,
    stroke: css(colours[i]), dash: dashes[i], width: 2}));
  byId("worst-note").textContent = "Deviation from the reference of the admissible motion with the largest mean-square error of " +
    "this estimator that was found (worst_case.csv): where it attains the guaranteed error, the guarantee cannot be smaller.";
  plot(box, {x: data.grid.t, series, yLabel: "deviation (m)", lines: [0]});
}

function drawResiduals(box) {
  box.replaceChildren();
  byId("residual-note").textContent = "Measured minus computed at the estimate, decorrelated and in units of sigma. " +
    "Good data scatter about 0 and nearly all lie within \u00b13 (dashed)." +
    (isNumber(data.numbers.chi2) ? ` Sum of squares ${number(data.numbers.chi2)} over ${data.numbers.components} components.` : "");
  const holders = data.residuals.map(r => {   // all in place before the first is measured
    const holder = element("div", {class: "plot"});
    box.append(element("div", {}, element("h3", {}, r.station + " ", element("small", {}, r.component)), holder));
    return holder;
  });
  data.residuals.forEach((r, k) => {
    const most = Math.max(4, ...r.values.map(Math.abs));
    plot(holders[k], {x: r.t, yLabel: "sigma", height: 190, lines: [-3, 0, 3], yRange: () => [-1.08 * most, 1.08 * most],
      series: [{stroke: css("--estimate"), width: 0, paths: () => null, values: r.values,
        points: {show: true, size: 4, fill: css("--estimate"), stroke: css("--estimate")}}]});
  });
}

function drawShares(box) {
  const colours = ["--estimate", "--gauss", "--second", "--third", "--nominal"].map(css);
  const bar = element("div", {class: "share", role: "img", "aria-label": "shares of the guaranteed squared error"});
  const key = [];
  data.shares.forEach((s, i) => {
    bar.append(element("i", {style: `width:${100 * s.share}%;background:${colours[i % colours.length]}`}));
    key.push({label: `${s.name} ${number(100 * s.share, 3)} %`, fill: colours[i % colours.length]});
  });
  byId("share-note").textContent = "Parts of the guaranteed squared error: measurement noise passed on by the estimator, and the " +
    "price of each bound (its multiplier). A bound with a large part is one that a tighter value, or better measurements, would pay off.";
  box.replaceChildren(bar, legend(key));
}

function writeFacts() {
  const table = element("table");
  for (const [name, value] of data.facts) table.append(element("tr", {}, element("th", {}, name), element("td", {}, value)));
  for (const input of data.inputs) {
    table.append(element("tr", {}, element("th", {}, "input " + input.name), element("td", {},
      element("code", {}, "SHA-256 " + input.sha256))));
  }
  byId("facts").append(table);
}

// ---- all together -----------------------------------------------------------------------------------

const drawings = [
  ["plan", drawPlan, true], ["height", drawHeight, true],
  ["error", drawError, data.grid.guaranteed_rms.some(isNumber)],
  ["share", drawShares, data.shares.length > 0],
  ["acceleration", drawAcceleration, data.segments.some(s => isNumber(s.magnitude) || isNumber(s.limit))],
  ["worst", drawWorst, data.worst !== null], ["residuals", drawResiduals, data.residuals.length > 0],
];

function drawAll() {
  for (const [id, draw, wanted] of drawings) {
    byId(id).closest("section").hidden = !wanted;
    if (wanted) draw(byId(id));
  }
}

startPage(() => {
  writeTop();
  if (data.statement) writeStatement();
  byId("statement-section").hidden = !data.statement;
  writeFacts();
}, drawAll);
})();
