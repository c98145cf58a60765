// Search in pages that are opened as files: browsers start no workers from files, so the worker's
// script runs in a hidden frame instead. The theme looks for `Worker` when somebody searches.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      this.frame.title = "search";
      document.body.append(this.frame);
      const inside = this.frame.contentWindow;
      inside.document.write("<!doctype html><title>search</title><body></body>");
      inside.document.close();
      inside.postMessage = (data) => queueMicrotask(() => {
        const event = new MessageEvent("message", { data });
        this.dispatchEvent(event);
        this.onmessage?.(event);
      });
      inside.importScripts = (...urls) => urls.reduce((before, source) => before.then(() => {
        const script = inside.document.createElement("script");
        script.src = source;
        inside.document.body.append(script);
        return new Promise((done) => { script.onload = done; });
      }), Promise.resolve());
      const script = inside.document.createElement("script");
      script.src = url;
      this.ready = new Promise((done) => { script.onload = done; });
      inside.document.body.append(script);
    }

    postMessage(data) {
      this.ready.then(() => {
        const frame = this.frame.contentWindow;
        frame.dispatchEvent(new frame.MessageEvent("message", { data: structuredClone(data) }));
      });
    }

    terminate() { this.frame.remove(); }
  };
}
