// Adds to the form of an upload: files can be dropped anywhere on it, what is sent shows its progress, and a refusal is
// shown above the form, which stays as it is.
"use strict";

const form = document.getElementById("upload");
const result = document.getElementById("result");

function tell(text) {
  const box = document.createElement("p");
  box.className = "problem";
  box.setAttribute("role", "alert");
  box.textContent = text;
  result.replaceChildren(box);
}

function finish(request, button) {
  if (new URL(request.responseURL).pathname.startsWith("/logs/")) {
    location.assign(request.responseURL);
    return;
  }
  const page = new DOMParser().parseFromString(request.responseText, "text/html");
  const problem = page.querySelector(".problem");
  if (problem === null) tell(`The service answered ${request.status} ${request.statusText}.`);
  else result.replaceChildren(problem);
  form.querySelector("details").open = true;  // a mapping or another format may be what it lacks
  result.scrollIntoView();
  button.disabled = false;
}

function send(event) {
  event.preventDefault();
  const button = form.querySelector("button"), progress = form.querySelector(".sent");
  const request = new XMLHttpRequest();
  request.upload.addEventListener("progress", (sent) => {
    progress.hidden = false;
    if (sent.lengthComputable) progress.value = sent.loaded / sent.total;
  });
  request.addEventListener("load", () => finish(request, button));
  request.addEventListener("loadend", () => { progress.hidden = true; });
  request.addEventListener("error", () => {
    tell("The connection was lost. Nothing that was sent in part is stored; try again.");
    button.disabled = false;
  });
  button.disabled = true;
  result.replaceChildren();
  request.open("POST", form.action);
  request.setRequestHeader("Accept", "text/html");
  request.send(new FormData(form));
}

function drop(event) {
  event.preventDefault();
  form.classList.remove("over");
  const [file] = event.dataTransfer.files;
  if (file === undefined) return;
  const held = new DataTransfer();
  held.items.add(file);
  form.elements.file.files = held.files;
}

if (form !== null) {
  form.addEventListener("submit", send);
  form.addEventListener("dragover", (event) => {
    event.preventDefault();
    form.classList.add("over");
  });
  form.addEventListener("dragleave", () => form.classList.remove("over"));
  form.addEventListener("drop", drop);
}
