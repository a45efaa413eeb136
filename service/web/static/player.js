// The player of a grasp log: a map of the contact on one canvas, stick ratio and forces over time on another.
// It reads the file that service/web/frames.py describes.
"use strict";

const root = document.querySelector(".player");
const find = (selector) => root.querySelector(selector);
const map = find(".map"), times = find(".times"), slider = find("input"), play = find(".play");
const arrows = find(".arrows"), speed = find(".speed"), told = find(".now");
const FULL_SCALE = 127, LEFT = 48, RIGHT = 12, GAP = 26;

let log = null, frame = 0, playing = false, started = 0, startTime = 0;

function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const kinds = { Float32Array, Uint8Array, Int8Array };
  for (const { name, type, offset, length: count } of header.arrays) {
    header[`${name}Values`] = new kinds[type](buffer, 4 + length + offset, count);
  }
  return header;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// The canvas in device pixels, with a context that draws in CSS pixels.
function prepared(canvas, height) {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return [context, width];
}

function drawMap() {
  const { rows, columns, stateValues: states } = log;
  const [context, width] = prepared(map, map.clientWidth * (rows / columns || 1));
  map.style.aspectRatio = `${columns} / ${rows}`;
  const size = width / columns, first = frame * rows * columns;
  const palette = [colour("none"), colour("stick"), colour("slip")];
  for (let state = 0; state < 3; state += 1) {
    context.fillStyle = palette[state];
    for (let cell = 0; cell < rows * columns; cell += 1) {
      if ((states ? states[first + cell] : 0) !== state) continue;
      const x = (cell % columns) * size, y = Math.floor(cell / columns) * size;
      context.fillRect(x + 0.5, y + 0.5, size - 1, size - 1);
      if (state === 2 && size > 8) drawSlash(context, x, y, size);
    }
  }
  const values = log[`${arrows.value}Values`];
  if (arrows.value && values) drawArrows(context, values, first, size);
}

// Slipping elements are told by a shape, too, not by colour alone.
function drawSlash(context, x, y, size) {
  context.save();
  context.strokeStyle = colour("ground");
  context.lineWidth = Math.max(1, size / 10);
  context.beginPath();
  context.moveTo(x + size * 0.3, y + size * 0.7);
  context.lineTo(x + size * 0.7, y + size * 0.3);
  context.stroke();
  context.restore();
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
  drawLine(context, width, log.stick_ratioValues, 10, half - GAP, 1, colour("stick"), []);
  if (hasForce) {
    const most = roundUp(Math.max(largest(log.normal_forceValues), largest(log.tangential_forceValues)));
    drawAxes(context, width, half + 10, height - 2 * GAP + 10, most, "force, N: normal ——  tangential - -");
    drawLine(context, width, log.normal_forceValues, half + 10, height - 2 * GAP + 10, most, colour("stick"), []);
    drawLine(context, width, log.tangential_forceValues, half + 10, height - 2 * GAP + 10, most, colour("slip"), [5, 4]);
  }
  context.fillStyle = colour("faint");
  context.textAlign = "center";
  for (let k = 0; k <= 4; k += 1) {
    const time = begin() + ((end() - begin()) * k) / 4;
    context.fillText(`${time.toFixed(2)} s`, Math.min(place(time, width), width - 22), height - 6);
  }
}

const largest = (values) => values.reduce((most, value) => Math.max(most, value), 0);

function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value || 1));
  return [1, 2, 4, 6, 8, 10].map((factor) => factor * power).find((round) => round >= value) || 1;
}

function drawAxes(context, width, top, bottom, most, label) {
  context.font = "13px system-ui, sans-serif";
  context.fillStyle = colour("faint");
  context.strokeStyle = colour("line");
  context.lineWidth = 1;
  context.textAlign = "right";
  context.beginPath();
  for (const part of [0, 0.5, 1]) {
    const y = bottom - (bottom - top) * part;
    context.fillText(Number((most * part).toPrecision(2)).toString(), LEFT - 6, y + 4);
    context.moveTo(LEFT, y);
    context.lineTo(width - RIGHT, y);
  }
  context.stroke();
  context.textAlign = "left";
  context.fillText(label, LEFT + 4, bottom + 15);
}

function drawLine(context, width, values, top, bottom, most, stroke, dash) {
  context.strokeStyle = stroke;
  context.lineWidth = 2;
  context.setLineDash(dash);
  context.beginPath();
  let pen = false;
  values.forEach((value, k) => {
    if (Number.isNaN(value)) {
      pen = false;
      return;
    }
    const x = place(log.timeValues[k], width), y = bottom - ((bottom - top) * value) / most;
    if (pen) context.lineTo(x, y);
    else context.moveTo(x, y);
    pen = true;
  });
  context.stroke();
  context.setLineDash([]);
}

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

const three = (value) => (Number.isNaN(value) ? "–" : Number(value.toPrecision(3)).toString());

function tell() {
  const parts = [`frame ${frame * log.step + 1} of ${log.frames}`, `${log.timeValues[frame].toFixed(3)} s`];
  const ratio = log.stick_ratioValues[frame];
  parts.push(Number.isNaN(ratio) ? "no contact" : `stick ratio ${three(ratio)}`);
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
