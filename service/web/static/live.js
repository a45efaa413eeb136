// One live stream as it goes on: the map of its newest frame, and curves of the last seconds.
// Each message is a frame as service/stream/live_frame.py packs it.
"use strict";

const root = document.querySelector(".player"), told = document.querySelector(".connection");
const map = root.querySelector(".map"), times = root.querySelector(".times");
const SHOWN_SECONDS = 20, READ_TOGETHER = 8, LONGEST_WAIT_MS = 10000, GAP = 26;
const FINISHED = 1000, REFUSED = 4000; // codes of ends after which there is nothing to wait for: 1000, and from 4000 on

let seen = [], socket = null, read = 0, wait = 500, isOver = false, isDue = false;

function onMessage(event) {
  const frame = unpack(event.data);
  read += 1;
  if (read % READ_TOGETHER === 0) socket.send("");
  if (frame.ended !== undefined) {
    showEnd(frame);
    return;
  }
  wait = 500;
  told.textContent = "Live";
  if (seen.length > 0 && frame.time < seen[seen.length - 1].time) seen = [];
  if (seen.length > 0) delete seen[seen.length - 1].stateValues; // only the newest is drawn as a map
  seen.push(frame);
  while (seen[0].time < frame.time - SHOWN_SECONDS) seen.shift();
  draw();
}

function draw() {
  if (isDue || seen.length === 0) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    const frame = seen[seen.length - 1];
    drawElements(map, frame.rows, frame.columns, frame.stateValues);
    drawTimes();
    tell(frame);
    root.dataset.frame = String(frame.number);
  });
}

const column = (name) => seen.map((frame) => frame[name] ?? NaN);
const ofFriction = (name) => seen.map((frame) => Math.max(frame.friction?.[name] ?? NaN, 0)); // a line's mean may fall below
const most = (...columns) => roundUp(Math.max(...columns.flat().filter((value) => !Number.isNaN(value)), 0));

function drawTimes() {
  const height = times.clientHeight, [context, width] = prepared(times, height);
  const last = seen[seen.length - 1].time, first = Math.max(seen[0].time, last - SHOWN_SECONDS);
  const seconds = seen.map((frame) => frame.time), third = (height - GAP) / 3;
  const across = (time) => LEFT + ((width - LEFT - RIGHT) * (time - first)) / (last - first || 1);
  const curve = (part, values, greatest, stroke, dash = []) => {
    const [top, bottom] = [part * third + 10, (part + 1) * third - GAP + 4];
    drawLine(context, seconds, values, across, (value) => bottom - ((bottom - top) * value) / greatest, colour(stroke), dash);
  };
  const axes = (part, greatest, label) => drawAxes(context, width, part * third + 10, (part + 1) * third - GAP + 4, greatest, label);
  axes(0, 1, "stick ratio (1: all sticks)");
  curve(0, column("stick_ratio"), 1, "stick");
  const [normal, tangential, command] = ["normal_force", "tangential_force", "command"].map(column);
  const force = most(normal, tangential, command);
  axes(1, force, "force, N: normal ——  tangential - -  commanded · ·");
  curve(1, normal, force, "stick");
  curve(1, tangential, force, "slip", [5, 4]);
  curve(1, command, force, "text", [2, 3]);
  const friction = most(ofFriction("high"));
  axes(2, friction, "μ ——  and 90 % of new observations - -");
  curve(2, ofFriction("mean"), friction, "stick");
  for (const name of ["low", "high"]) curve(2, ofFriction(name), friction, "stick", [5, 4]);
  drawSeconds(context, width, height, first, last, across);
}

function tell(frame) {
  const unit = (value, name) => (value === undefined || value === null ? "–" : `${three(value)} ${name}`);
  const { friction } = frame;
  const facts = {
    time: `${frame.time.toFixed(2)} s, frame ${frame.number}`,
    stick_ratio: frame.stick_ratio === null ? "no contact" : three(frame.stick_ratio) + (frame.macro_slip ? ", gross slip" : ""),
    friction: friction === null ? "no samples yet" : `${three(Math.max(friction.mean, 0))} (${three(friction.low)} to ${three(friction.high)})`,
    normal_force: unit(frame.normal_force, "N"),
    tangential_force: unit(frame.tangential_force, "N"),
    command: unit(frame.command, "N"),
  };
  for (const [name, text] of Object.entries(facts)) root.querySelector(`[data-fact=${name}]`).textContent = text;
}

function showEnd({ ended, grasp_log: log }) {
  isOver = true;
  told.textContent = `${ended} `;
  const link = document.createElement("a");
  link.href = log === null ? "/live" : `/logs/${log}`;
  link.textContent = log === null ? "Other live streams" : "Its grasp log";
  told.append(link);
}

function onClose({ code, reason }) {
  if (isOver) return;
  if (code === FINISHED || code >= REFUSED) {
    told.textContent = `Not shown any more: ${reason}.`;
    return;
  }
  told.textContent = "The connection is lost; trying again…";
  setTimeout(connect, wait);
  wait = Math.min(2 * wait, LONGEST_WAIT_MS);
}

function connect() {
  const address = new URL(root.dataset.frames, location.href);
  address.protocol = address.protocol.replace("http", "ws");
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  read = 0;
  socket.addEventListener("message", onMessage);
  socket.addEventListener("close", onClose);
}

new ResizeObserver(draw).observe(root);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
connect();
