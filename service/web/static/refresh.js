// Renews the part of the page that is marked with data-refresh, without loading the whole page anew. Where the new page
// has no such part any more, what was waited for has come, and the page is loaded whole.
"use strict";

const EVERY_MS = 1500;

async function renew() {
  const part = document.querySelector("[data-refresh]");
  if (part === null) return;
  if (!document.hidden) {
    const answer = await fetch(location.href, { headers: { accept: "text/html" } }).catch(() => null);
    if (answer !== null && answer.ok) {
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      const fresh = page.querySelector("[data-refresh]");
      if (fresh === null) {
        location.reload();
        return;
      }
      if (!part.contains(document.activeElement)) part.replaceWith(fresh);
    }
  }
  setTimeout(renew, EVERY_MS);
}

setTimeout(renew, EVERY_MS);
