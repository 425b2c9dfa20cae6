// Runs the search of the theme in a hidden frame instead of a worker, which browsers refuse to pages that are opened as
// files.
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
