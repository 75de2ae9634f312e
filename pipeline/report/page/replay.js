"use strict";
// Clouds and calibrated bands, frame by frame. Reads the JSON in #data (pipeline/report/page/replays.py).
(() => {
  const find = (id) => document.getElementById(id);
  const data = JSON.parse(find("data").textContent);
  const plot = find("plot"), slider = find("frame");
  const TAKEN = 0.25;  // s before the release at which the replay stands first
  const TICK = 30;  // ms between pictures
  const CONFIG = {
    displaylogo: false, responsive: true, modeBarButtons: [["resetCameraDefault3d", "toImage"]],
  };
  let band = null, frame = 0, playing = null;

  const metres = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return Float32Array.from(new Int16Array(bytes.buffer), (value) => value / 1000);
  };
  const axes = (values, begin, end) => [0, 1, 2].map((axis) => {
    const one = [];
    for (let i = begin; i < end; i++) one.push(values[3 * i + axis]);
    return one;
  });
  const unpack = (one) => {
    const first = [0];
    for (const count of one.counts) first.push(first[first.length - 1] + count);
    const methods = one.methods.map((m) => ({ ...m, values: metres(m.line), on: m.shown }));
    return { ...one, first, points: metres(one.cloud), methods };
  };

  const points = () => axes(band.points, band.first[frame], band.first[frame + 1]);
  const line = (m) => axes(m.values, frame * m.nodes, (frame + 1) * m.nodes);
  const nearest = (time) => {
    let best = 0;
    band.times.forEach((t, i) => { if (Math.abs(t - time) < Math.abs(band.times[best] - time)) best = i; });
    return best;
  };

  const traces = () => {
    const half = data.fork.width / 2, down = Math.max(-data.fork.height, band.low[2]);
    const fork = {
      type: "scatter3d", mode: "lines", name: "fork", hoverinfo: "skip",
      x: [-half, -half, null, half, half], y: [0, 0, null, 0, 0], z: [0, down, null, 0, down],
      line: { color: "#999999", width: 8 },
    };
    const [x, y, z] = points();
    const cloud = {
      type: "scatter3d", mode: "markers", name: "measured", hoverinfo: "skip", x, y, z,
      marker: { color: "#222222", size: 2 },
    };
    const bands = band.methods.map((m) => {
      const [x, y, z] = line(m);
      return {
        type: "scatter3d", mode: "lines", name: m.name, hoverinfo: "skip", x, y, z, visible: m.on,
        line: { color: m.color, width: 6 },
      };
    });
    return [fork, cloud, ...bands];
  };
  const layout = () => {
    const axis = (name, i) => ({
      title: { text: name + " [m]" }, range: [band.low[i], band.high[i]], autorange: false,
    });
    return {
      margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, uirevision: band.name,
      scene: {
        xaxis: axis("x", 0), yaxis: axis("y", 1), zaxis: axis("z", 2), aspectmode: "data",
        camera: { eye: { x: 1.42, y: -1.25, z: 0.55 }, center: { x: 0, y: 0, z: -0.3 } },
        uirevision: band.name,
      },
    };
  };

  const tell = () => {
    const since = band.times[frame] - band.release;
    const sign = since < 0 ? "−" : "+";
    find("time").textContent =
      `${sign}${Math.abs(since).toFixed(3)} s from the release, frame ${frame + 1}/${band.times.length}`;
    band.methods.forEach((m, i) => {
      const off = m.distance[frame];
      find(`distance-${i}`).textContent = off === null ? "–" : `${(off / 10).toFixed(2)} cm off`;
    });
  };
  const draw = () => {
    slider.value = frame;
    tell();
    return Plotly.react(plot, traces(), layout(), CONFIG);
  };
  const show = (which) => { frame = which; return draw(); };

  const choose = (number) => {
    band = unpack(data.bands[number]);
    slider.max = band.times.length - 1;
    find("methods").replaceChildren(...band.methods.map((m, i) => {
      const label = document.createElement("label"), box = document.createElement("input");
      const off = document.createElement("b");
      box.type = "checkbox";
      box.checked = m.on;
      box.addEventListener("change", () => { m.on = box.checked; draw(); });
      off.id = `distance-${i}`;
      label.style.color = m.color;
      label.append(box, ` ${m.name} `, off);
      return label;
    }));
    return show(nearest(band.release - TAKEN));
  };

  const stop = () => {
    clearTimeout(playing);
    playing = null;
    find("play").textContent = "▶ play";
  };
  const play = () => {
    find("play").textContent = "❚❚ pause";
    if (frame === band.times.length - 1) frame = 0;
    let time = band.times[frame], before = performance.now();
    const step = async () => {
      const now = performance.now();
      time += (now - before) / 1000 * Number(find("speed").value);
      before = now;
      let next = frame;
      while (next < band.times.length - 1 && band.times[next + 1] <= time) next++;
      if (next !== frame) await show(next);
      if (frame === band.times.length - 1) stop();
      else if (playing !== null) playing = setTimeout(step, TICK);
    };
    playing = setTimeout(step, TICK);
  };

  data.bands.forEach((one, i) => find("band").add(new Option(one.name, i)));
  find("band").addEventListener("change", (event) => { stop(); choose(Number(event.target.value)); });
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  find("play").addEventListener("click", () => (playing === null ? play() : stop()));
  find("recoil").addEventListener("click", () => { stop(); show(nearest(band.release)); });
  if (data.bands.length) choose(0);
})();
