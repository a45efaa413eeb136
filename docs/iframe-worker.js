// A browser starts no worker for a page that was opened as a file. The site's search then runs in a hidden frame.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    #frame = document.createElement("iframe");
    #loaded;

    constructor(url) {
      super();
      this.#frame.hidden = true;
      document.body.append(this.#frame);
      const inner = this.#frame.contentWindow;
      inner.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }));
      const script = inner.document.createElement("script");
      this.#loaded = new Promise((loaded, failed) => {
        script.onload = loaded;
        script.onerror = failed;
      });
      script.src = url;
      inner.document.body.append(script);
    }

    postMessage(data) {
      const sent = () => this.#frame.contentWindow.dispatchEvent(new MessageEvent("message", { data }));
      this.#loaded.then(sent, () => this.dispatchEvent(new Event("error")));
    }

    terminate() {
      this.#frame.remove();
    }
  };
}
