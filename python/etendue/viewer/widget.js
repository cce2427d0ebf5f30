// The page in a notebook: in a frame of its own, which may run its script and hand out files, and nothing else.
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.style.cssText = "width: 100%; border: 0; border-radius: 6px;";
    frame.style.height = `${model.get("height")}px`;
    frame.title = model.get("title");
    frame.srcdoc = model.get("page");
    el.append(frame);
  },
};
