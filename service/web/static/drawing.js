// What the player of a log and the view of a live stream draw with. Both read what service/packed_arrays.py packs.
"use strict";

const LEFT = 48, RIGHT = 12; // of a picture over time, beside its axes, in CSS pixels

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

// The state of each element: 0 no contact, 1 sticks, 2 slips. Returns the context and an element's size, in CSS pixels.
function drawElements(canvas, rows, columns, states) {
  const [context, width] = prepared(canvas, canvas.clientWidth * (rows / columns || 1));
  canvas.style.aspectRatio = `${columns} / ${rows}`;
  const size = width / columns, palette = [colour("none"), colour("stick"), colour("slip")];
  for (let state = 0; state < 3; state += 1) {
    context.fillStyle = palette[state];
    for (let cell = 0; cell < rows * columns; cell += 1) {
      if (states[cell] !== state) continue;
      const x = (cell % columns) * size, y = Math.floor(cell / columns) * size;
      context.fillRect(x + 0.5, y + 0.5, size - 1, size - 1);
      if (state === 2 && size > 8) drawSlash(context, x, y, size);
    }
  }
  return [context, size];
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

function drawAxes(context, width, top, bottom, most, label) {
  const levels = [0, 0.5, 1].map((part) => [bottom - (bottom - top) * part, Number((most * part).toPrecision(2)).toString()]);
  drawLevels(context, width, levels);
  context.fillText(label, LEFT + 4, bottom + 15);
}

// Lines across the picture, each [its height, what stands beside it].
function drawLevels(context, width, levels) {
  context.font = "13px system-ui, sans-serif";
  context.fillStyle = colour("faint");
  context.strokeStyle = colour("line");
  context.lineWidth = 1;
  context.textAlign = "right";
  context.beginPath();
  for (const [y, text] of levels) {
    context.fillText(text, LEFT - 6, y + 4);
    context.moveTo(LEFT, y);
    context.lineTo(width - RIGHT, y);
  }
  context.stroke();
  context.textAlign = "left";
}

// A line through the values over time, broken where there is none; across and up say where a point lies.
function drawLine(context, seconds, values, across, up, stroke, dash) {
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
    const x = across(seconds[k]), y = up(value);
    if (pen) context.lineTo(x, y);
    else context.moveTo(x, y);
    pen = true;
  });
  context.stroke();
  context.setLineDash([]);
}

function drawSeconds(context, width, height, first, last, across) {
  context.fillStyle = colour("faint");
  context.textAlign = "center";
  for (let k = 0; k <= 4; k += 1) {
    const time = first + ((last - first) * k) / 4;
    context.fillText(`${time.toFixed(2)} s`, Math.min(across(time), width - 22), height - 6);
  }
}

function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value || 1));
  return [1, 2, 4, 6, 8, 10].map((factor) => factor * power).find((round) => round >= value) || 1;
}

const three = (value) => (Number.isNaN(value) ? "–" : Number(value.toPrecision(3)).toString());
