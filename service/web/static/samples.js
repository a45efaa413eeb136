// The samples of a material: in space with its model, and their residuals by place and over time.
// It reads the file that service/web/samples.py describes.
"use strict";

const root = document.querySelector(".samples");
const find = (selector) => root.querySelector(selector);
const told = find(".now"), space = find(".space"), places = find(".places"), times = find(".times");
const VIEWS = { turned: [-0.7, 0.42], force: [-Math.PI / 2, 0], velocity: [0, 0] }; // yaw and pitch
const TURN = Math.PI / 36, HEIGHT = 340, BINS = 20;

let found = null, yaw = 0, pitch = 0;

const largest = (values) => values.reduce((most, value) => (value > most ? value : most), 0);

// From a point in the box, each coordinate in 0 … 1 (velocity, force, friction), to the canvas.
function projection(width) {
  const [sinYaw, cosYaw, sinPitch, cosPitch] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
  const across = Math.min(width - 130, 420) / 1.42, up = HEIGHT - 150;
  return (velocity, force, friction) => {
    const x = velocity - 0.5, y = force - 0.5, z = friction - 0.5;
    const depth = x * sinYaw + y * cosYaw;
    return [width / 2 + across * (x * cosYaw - y * sinYaw), HEIGHT / 2 - up * (z * cosPitch + depth * sinPitch)];
  };
}

function drawSpace() {
  const [context, width] = prepared(space, HEIGHT), at = projection(width), most = found.most;
  const seen = (v, f, mu) => at(v / most.velocity, f / most.force, mu / most.friction);
  drawBox(context, at);
  for (const sheet of ["low", "high"]) drawSheet(context, seen, found[`${sheet}Values`]);
  drawSamples(context, seen);
  drawPlane(context, seen);
}

function path(context, corners) {
  context.beginPath();
  corners.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
}

// The floor, the upright at the left, and what is written at the floor's edges that lie in front.
function drawBox(context, at) {
  const floor = [[0, 0], [1, 0], [1, 1], [0, 1]];
  context.strokeStyle = colour("line");
  context.lineWidth = 1;
  path(context, [...floor, floor[0]].map(([v, f]) => at(v, f, 0)));
  context.stroke();
  const left = floor.reduce((a, b) => (at(...b, 0)[0] < at(...a, 0)[0] ? b : a));
  path(context, [at(...left, 0), at(...left, 1)]);
  context.stroke();
  context.font = "13px system-ui, sans-serif";
  context.fillStyle = colour("faint");
  if (Math.abs(Math.cos(yaw)) > 0.2) {
    const front = at(0.5, 0, 0)[1] >= at(0.5, 1, 0)[1] ? 0 : 1;
    writeAxis(context, (part) => at(part, front, 0), found.most.velocity, "velocity, m/s");
  }
  if (Math.abs(Math.sin(yaw)) > 0.2) {
    const front = at(0, 0.5, 0)[1] >= at(1, 0.5, 0)[1] ? 0 : 1;
    writeAxis(context, (part) => at(front, part, 0), found.most.force, "normal force, N");
  }
  context.textAlign = "right";
  for (const part of [0.5, 1]) {
    const [x, y] = at(...left, part);
    context.fillText(three(found.most.friction * part), x - 6, y + 4);
  }
  context.textAlign = "left";
  context.fillText("friction coefficient μ", 6, 16);
}

// Below an edge of the floor: both ends' values, and what it is; left of an edge on the left, for there ends another one.
function writeAxis(context, along, most, label) {
  const [begin, end, [x, y]] = [along(0), along(1), along(0.5)], away = x - space.clientWidth / 2;
  const isFlat = Math.abs(away) < 20, shift = isFlat ? 0 : 6 * Math.sign(away);
  context.textAlign = isFlat ? "center" : away < 0 ? "right" : "left";
  for (const [at, text] of [[begin, "0"], [end, three(most)]]) context.fillText(text, at[0] + shift, at[1] + 15);
  context.fillText(label, x + shift, y + (isFlat ? 34 : 20));
}

const corner = (seen, values, i, j) => {
  const lines = found.lattice_forceValues.length;
  return seen(found.lattice_velocityValues[i], found.lattice_forceValues[j], Math.max(values[i * lines + j], 0));
};

function drawSheet(context, seen, values) {
  const last = found.lattice_forceValues.length - 1, along = [...Array(last + 1).keys()], back = [...along].reverse();
  const edge = [...along.map((k) => [0, k]), ...along.map((k) => [k, last]), ...back.map((k) => [last, k]), ...back.map((k) => [k, 0])];
  path(context, edge.map(([i, j]) => corner(seen, values, i, j)));
  context.fillStyle = colour("band");
  context.fill();
  context.strokeStyle = colour("accent");
  context.lineWidth = 1;
  context.setLineDash([4, 4]);
  context.stroke();
  context.setLineDash([]);
}

function drawPlane(context, seen) {
  const lines = found.lattice_forceValues.length, along = [...Array(lines).keys()];
  context.strokeStyle = colour("text");
  context.lineWidth = 1;
  for (let k = 0; k < lines; k += 2) {
    path(context, along.map((j) => corner(seen, found.meanValues, k, j)));
    context.stroke();
    path(context, along.map((i) => corner(seen, found.meanValues, i, k)));
    context.stroke();
  }
}

function drawSamples(context, seen) {
  const { velocityValues: v, forceValues: f, frictionValues: mu, outsideValues: outside } = found;
  context.globalAlpha = 0.6;
  for (let k = 0; k < v.length; k += 1) {
    const [x, y] = seen(v[k], f[k], mu[k]);
    drawSample(context, x, y, outside[k]);
  }
  context.globalAlpha = 1;
}

// A dot, or a cross for what lies outside of the band.
function drawSample(context, x, y, isOutside) {
  if (!isOutside) {
    context.fillStyle = colours.stick;
    context.fillRect(x - 1.25, y - 1.25, 2.5, 2.5);
    return;
  }
  context.strokeStyle = colours.slip;
  context.lineWidth = 1.25;
  context.beginPath();
  context.moveTo(x - 2.5, y - 2.5);
  context.lineTo(x + 2.5, y + 2.5);
  context.moveTo(x - 2.5, y + 2.5);
  context.lineTo(x + 2.5, y - 2.5);
  context.stroke();
}

let colours = {};

function drawPlaces() {
  const { rows, columns, place_residualValues: residual } = found;
  const [context, width] = prepared(places, (places.clientWidth * rows) / columns);
  places.style.aspectRatio = `${columns} / ${rows}`;
  const size = width / columns, most = largest(residual.map(Math.abs).filter((value) => value > 0)) || 1;
  residual.forEach((value, cell) => {
    const x = (cell % columns) * size, y = Math.floor(cell / columns) * size;
    context.fillStyle = colours.none;
    context.globalAlpha = Number.isNaN(value) ? 0.5 : 1;
    if (Number.isNaN(value)) return context.fillRect(x + size * 0.35, y + size * 0.35, size * 0.3, size * 0.3);
    context.fillStyle = value > 0 ? colours.slip : colours.stick;
    context.globalAlpha = 0.12 + 0.88 * (Math.abs(value) / most);
    return context.fillRect(x + 0.5, y + 0.5, size - 1, size - 1);
  });
  context.globalAlpha = 1;
  find(".scale").textContent = `The strongest colour is a mean residual of ${three(most)}.`;
}

function drawTimes() {
  const [context, width] = prepared(times, HEIGHT), { secondsValues: seconds, residualValues: residual } = found;
  const last = largest(seconds) || 1, most = roundUp(largest(residual.map(Math.abs)));
  const across = (time) => LEFT + ((width - LEFT - RIGHT) * time) / last;
  const up = (value) => (HEIGHT - 40) / 2 + 10 - ((HEIGHT - 50) / 2) * (value / most);
  const levels = [-1, -0.5, 0, 0.5, 1].map((part) => most * part);
  drawLevels(context, width, levels.map((level) => [up(level), three(level).replace("-", "−")]));
  context.fillText("friction coefficient above the model's", LEFT + 4, 26);
  context.globalAlpha = 0.5;
  seconds.forEach((time, k) => drawSample(context, across(time), up(residual[k]), found.outsideValues[k]));
  context.globalAlpha = 1;
  const [middles, means] = binned(seconds, residual, last);
  drawLine(context, middles, means, across, up, colour("text"), []);
  drawSeconds(context, width, HEIGHT, 0, last, across);
}

// Means of the residuals over equal parts of the time; NaN where there are none.
function binned(seconds, residual, last) {
  const count = new Float64Array(BINS), total = new Float64Array(BINS);
  seconds.forEach((time, k) => {
    const bin = Math.min(Math.floor((time / last) * BINS), BINS - 1);
    count[bin] += 1;
    total[bin] += residual[k];
  });
  return [count.map((_, bin) => ((bin + 0.5) / BINS) * last), total.map((sum, bin) => sum / count[bin])];
}

function draw() {
  colours = { stick: colour("stick"), slip: colour("slip"), none: colour("none") };
  drawSpace();
  drawPlaces();
  drawTimes();
}

function turnTo(newYaw, newPitch) {
  [yaw, pitch] = [newYaw, Math.min(Math.max(newPitch, 0), Math.PI / 2)];
  root.dataset.turned = `${yaw.toFixed(2)} ${pitch.toFixed(2)}`;
  drawSpace();
}

function onKey(event) {
  const turns = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, TURN], ArrowDown: [0, -TURN] };
  if (event.key in turns) turnTo(yaw + turns[event.key][0], pitch + turns[event.key][1]);
  else if (event.key === "Home") turnTo(...VIEWS.turned);
  else return;
  event.preventDefault();
}

function onPointer(event) {
  if (event.buttons === 1) turnTo(yaw + event.movementX * 0.01, pitch + event.movementY * 0.01);
}

function connect() {
  space.addEventListener("keydown", onKey);
  space.addEventListener("pointermove", onPointer);
  for (const button of root.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => turnTo(...VIEWS[button.dataset.view]));
  }
  new ResizeObserver(draw).observe(root);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}

function tell() {
  const shown = found.velocityValues.length, logs = (count) => `${count} ${count === 1 ? "log" : "logs"}`;
  const parts = [`${found.of} samples of ${logs(found.logs)}`];
  if (shown < found.of) parts.push(`${shown} of them drawn`);
  parts.push(`${three(100 * found.share)} % outside of the band`);
  if (found.at_rest) parts.push(`velocity unknown in ${logs(found.at_rest)}, drawn as 0`);
  told.textContent = parts.join(" · ");
}

async function load() {
  const answer = await fetch(root.dataset.samples, { headers: { accept: "application/json" } });
  if (!answer.ok) throw new Error((await answer.json()).detail);
  found = unpack(await answer.arrayBuffer());
  found.most = {
    velocity: largest(found.velocityValues) || 1,
    force: largest(found.forceValues) || 1,
    friction: roundUp(Math.max(largest(found.frictionValues), largest(found.highValues))),
  };
  find(".charts").hidden = false;
  connect();
  [yaw, pitch] = VIEWS.turned;
  draw();
  tell();
  root.dataset.ready = "yes";
}

load().catch((error) => {
  told.textContent = `The samples cannot be shown: ${error.message}`;
  told.classList.add("problem");
});
