// The player of a grasp log: a map of the contact on one canvas, stick ratio and forces over time on another.
// It reads the file that service/web/frames.py describes.
"use strict";

const root = document.querySelector(".player");
const find = (selector) => root.querySelector(selector);
const map = find(".map"), times = find(".times"), slider = find("input"), play = find(".play");
const arrows = find(".arrows"), speed = find(".speed"), told = find(".now");
const FULL_SCALE = 127, GAP = 26;

let log = null, frame = 0, playing = false, started = 0, startTime = 0;

function drawMap() {
  const { rows, columns, stateValues: states } = log, cells = rows * columns, first = frame * cells;
  const shown = states ? states.subarray(first, first + cells) : new Uint8Array(cells);
  const [context, size] = drawElements(map, rows, columns, shown);
  const values = log[`${arrows.value}Values`];
  if (states) drawOutlines(context, shown, size);
  drawPatches(context, size);
  if (arrows.value && values) drawArrows(context, values, first, size);
}

// Around each contact patch: where an element touches and its neighbour does not.
function drawOutlines(context, shown, size) {
  const { rows, columns } = log;
  const touches = (row, column) => row >= 0 && row < rows && column >= 0 && column < columns && shown[row * columns + column] > 0;
  context.strokeStyle = colour("text");
  context.lineWidth = 2;
  context.beginPath();
  for (let row = 0; row <= rows; row += 1) {
    for (let column = 0; column <= columns; column += 1) {
      const x = column * size, y = row * size, here = touches(row, column);
      if (here !== touches(row - 1, column)) {
        context.moveTo(x, y);
        context.lineTo(x + size, y);
      }
      if (here !== touches(row, column - 1)) {
        context.moveTo(x, y);
        context.lineTo(x, y + size);
      }
    }
  }
  context.stroke();
}

// The centre of each patch as a cross, its longer arm along the patch's longer axis; a round one has none.
function drawPatches(context, size) {
  const places = log.patch_placeValues;
  if (!places) return;
  context.strokeStyle = colour("text");
  context.lineWidth = 2;
  context.beginPath();
  for (const k of patchesAt(frame)) {
    const [column, row, dx, dy] = places.subarray(4 * k, 4 * k + 4);
    if (Number.isNaN(column)) continue;
    const x = (column + 0.5) * size, y = (row + 0.5) * size, isRound = Number.isNaN(dx);
    const [a, b, long] = isRound ? [1, 0, 0.6 * size] : [dx, dy, 1.6 * size];
    for (const [along, across] of [[long, 0], [0, 0.6 * size]]) {
      context.moveTo(x - along * a + across * b, y - along * b - across * a);
      context.lineTo(x + along * a - across * b, y + along * b + across * a);
    }
  }
  context.stroke();
}

// Which entries are of a frame; they are in the order of frames.
function patchesAt(wanted) {
  const frames = log.patch_frameValues, found = [];
  if (!frames) return found;
  for (let k = firstNotBelow(frames, wanted); k < frames.length && frames[k] === wanted; k += 1) found.push(k);
  return found;
}

function firstNotBelow(values, wanted) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = Math.floor((low + high) / 2);
    if (values[middle] < wanted) low = middle + 1;
    else high = middle;
  }
  return low;
}

function drawArrows(context, values, first, size) {
  const { rows, columns } = log, longest = (2.2 * size) / FULL_SCALE;
  context.strokeStyle = colour("text");
  context.lineWidth = 1.5;
  context.beginPath();
  for (let cell = 0; cell < rows * columns; cell += 1) {
    const along = values[2 * (first + cell)] * longest, across = values[2 * (first + cell) + 1] * longest;
    const length = Math.hypot(along, across);
    if (length < 1.5) continue;
    const x = ((cell % columns) + 0.5) * size, y = (Math.floor(cell / columns) + 0.5) * size;
    const dx = along, dy = across, back = Math.min(4, length / 2) / length;
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
    context.moveTo(x + dx - back * (dx - dy), y + dy - back * (dy + dx));
    context.lineTo(x + dx, y + dy);
    context.lineTo(x + dx - back * (dx + dy), y + dy - back * (dy - dx));
  }
  context.stroke();
}

const begin = () => log.timeValues[0];
const end = () => log.timeValues[log.timeValues.length - 1];
const place = (time, width) => LEFT + ((width - LEFT - RIGHT) * (time - begin())) / (end() - begin() || 1);

let curves = null; // what does not change with the frame, drawn once a size

function drawTimes() {
  const height = 320, [context, width] = prepared(times, height);
  if (curves === null || curves.width !== times.width || curves.dark !== colour("ground")) {
    drawCurves(context, width, height);
    curves = document.createElement("canvas");
    curves.width = times.width;
    curves.height = times.height;
    curves.getContext("2d").drawImage(times, 0, 0);
    curves.dark = colour("ground");
  } else {
    context.drawImage(curves, 0, 0, width, height);
  }
  const x = place(log.timeValues[frame], width);
  context.strokeStyle = colour("text");
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, 4);
  context.lineTo(x, height - GAP);
  context.stroke();
}

function drawCurves(context, width, height) {
  const hasForce = log.normal_forceValues !== undefined;
  const half = hasForce ? (height - GAP) / 2 : height - GAP;
  drawAxes(context, width, 10, half - GAP, 1, "stick ratio (1: all sticks)");
  drawOnsets(context, width, 10, half - GAP);
  drawCurve(context, width, log.stick_ratioValues, 10, half - GAP, 1, "stick", []);
  if (hasForce) {
    const most = roundUp(Math.max(largest(log.normal_forceValues), largest(log.tangential_forceValues)));
    drawAxes(context, width, half + 10, height - 2 * GAP + 10, most, "force, N: normal ——  tangential - -");
    drawCurve(context, width, log.normal_forceValues, half + 10, height - 2 * GAP + 10, most, "stick", []);
    drawCurve(context, width, log.tangential_forceValues, half + 10, height - 2 * GAP + 10, most, "slip", [5, 4]);
  }
  drawSeconds(context, width, height, begin(), end(), (time) => place(time, width));
}

function drawCurve(context, width, values, top, bottom, most, stroke, dash) {
  const up = (value) => bottom - ((bottom - top) * value) / most;
  drawLine(context, log.timeValues, values, (time) => place(time, width), up, colour(stroke), dash);
}

const largest = (values) => values.reduce((most, value) => Math.max(most, value), 0);

// Onsets of slip as marks below the stick ratio, the darker the more there are.
function drawOnsets(context, width, top, bottom) {
  context.strokeStyle = colour("slip");
  context.globalAlpha = 0.25;
  context.lineWidth = 1;
  context.beginPath();
  for (const time of log.onsetValues) {
    const x = place(time, width);
    context.moveTo(x, bottom - 8);
    context.lineTo(x, bottom);
  }
  context.stroke();
  context.globalAlpha = 1;
}

function tell() {
  const parts = [`frame ${frame * log.step + 1} of ${log.frames}`, `${log.timeValues[frame].toFixed(3)} s`];
  const ratio = log.stick_ratioValues[frame];
  parts.push(Number.isNaN(ratio) ? "no contact" : `stick ratio ${three(ratio)}`);
  const regimes = patchesAt(frame).map((k) => log.regimes[log.patch_regimeValues[k]]);
  if (regimes.length) parts.push(`${regimes.length === 1 ? "patch" : "patches"}: ${regimes.join(", ")}`);
  if (log.normal_forceValues) {
    parts.push(`normal force ${three(log.normal_forceValues[frame])} N`);
    parts.push(`tangential force ${three(log.tangential_forceValues[frame])} N`);
  }
  if (arrows.value && log[arrows.value]) {
    const unit = arrows.value === "force" ? "N" : "m";
    parts.push(`longest arrow: ${log[arrows.value].toPrecision(3)} ${unit}`);
  }
  told.textContent = parts.join(" · ");
}

function show(next) {
  frame = Math.min(Math.max(next, 0), log.timeValues.length - 1);
  slider.value = String(frame);
  drawMap();
  drawTimes();
  tell();
}

function frameAt(time) {
  const values = log.timeValues;
  let low = 0, high = values.length - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (values[middle] <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

function step(now) {
  if (!playing) return;
  const time = startTime + ((now - started) / 1000) * Number(speed.value);
  const next = frameAt(time);
  if (next !== frame) show(next);
  if (time >= end()) setPlaying(false);
  else requestAnimationFrame(step);
}

function setPlaying(wanted) {
  playing = wanted;
  play.textContent = playing ? "Pause" : "Play";
  told.setAttribute("role", playing ? "none" : "status"); // a screen reader need not read every frame
  if (!playing) return;
  if (frame === log.timeValues.length - 1) show(0);
  started = performance.now();
  startTime = log.timeValues[frame];
  requestAnimationFrame(step);
}

function moveTo(next) {
  setPlaying(false);
  show(next);
}

function onKey(event) {
  const last = log.timeValues.length - 1;
  const moves = { ArrowLeft: frame - 1, ArrowRight: frame + 1, PageUp: frame - 10, PageDown: frame + 10, Home: 0, End: last };
  if (event.key in moves) moveTo(moves[event.key]);
  else if (event.key === " ") setPlaying(!playing);
  else return;
  event.preventDefault();
}

function onPointer(event) {
  if (event.type === "pointermove" && event.buttons === 0) return;
  const part = (event.offsetX - LEFT) / (times.clientWidth - LEFT - RIGHT);
  moveTo(frameAt(begin() + part * (end() - begin())));
}

function connect() {
  slider.max = String(log.timeValues.length - 1);
  slider.disabled = play.disabled = false;
  slider.addEventListener("input", () => moveTo(Number(slider.value)));
  play.addEventListener("click", () => setPlaying(!playing));
  map.addEventListener("keydown", onKey);
  times.addEventListener("pointerdown", onPointer);
  times.addEventListener("pointermove", onPointer);
  arrows.addEventListener("change", () => show(frame));
  speed.addEventListener("change", () => setPlaying(playing));
  new ResizeObserver(() => show(frame)).observe(root);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => show(frame));
  for (const option of arrows.options) option.disabled = option.value !== "" && !log[`${option.value}Values`];
}

async function load() {
  const answer = await fetch(root.dataset.frames, { headers: { accept: "application/json" } });
  if (!answer.ok) {
    const problem = await answer.json();
    throw new Error(problem.detail);
  }
  log = unpack(await answer.arrayBuffer());
  connect();
  const slipping = log.stick_ratioValues.findIndex((ratio) => ratio < 1);
  show(Math.max(slipping, 0));
  if (!log.stateValues) told.textContent += " · an older version kept no map of this log";
  root.dataset.ready = "yes";
}

load().catch((error) => {
  told.textContent = `The frames cannot be shown: ${error.message}`;
  told.classList.add("problem");
});
