// Lets the search box work on pages that are opened as files. Browsers refuse workers and requests there, so the index
// comes as a script (search_index.js) and the theme's search runs in a hidden frame instead of a worker.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      window.searchAnswer = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      this.ready = new Promise((resolve) => (frame.onload = () => resolve(frame.contentWindow)));
      frame.srcdoc = `<script>postMessage = (data) => parent.searchAnswer(data)</script>
                      <script src="${new URL(url, location)}"></script>`;
      document.body.append(frame);
    }
    postMessage(data) {
      this.ready.then((frame) => frame.dispatchEvent(new frame.MessageEvent("message", { data })));
    }
  };
} else {
  __search = undefined;
}
