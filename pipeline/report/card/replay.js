"use strict";
// The camera's points and the simulated band, moment by moment. Reads the JSON in #data
// (pipeline/report/card/page.py): times in seconds from the release, places in millimetres, frame O.
(() => {
  const find = (id) => document.getElementById(id);
  const data = JSON.parse(find("data").textContent);
  const view = find("view"), slider = find("moment"), pen = view.getContext("2d");
  const whole = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Int16Array(bytes.buffer);
  };
  const line = whole(data.line), cloud = whole(data.cloud), first = [0];
  for (const count of data.counts) first.push(first[first.length - 1] + count);
  const WINDOWS = { release: data.release, all: [data.times[0], data.times[data.times.length - 1]] };
  const AGED = 0.035;  // s after which a cloud is pale
  const TURN = 0.008, KEY = 0.08;  // radians a pixel, and a key
  let time = data.release[0], yaw = 0.95, pitch = 0.5, playing = null;

  const last = (times, moment) => {  // number of the last one at or before a moment
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= moment) low = middle; else high = middle - 1;
    }
    return low;
  };

  const project = () => {  // turned about the middle of what moves, seen from far away
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    const scale = Math.min(view.width, view.height / 0.8) / data.size;
    const [x0, y0, z0] = data.centre;
    return (x, y, z) => {
      const [dx, dy, dz] = [x - x0, y - y0, z - z0];
      const across = cy * dx + sy * dy, away = -sy * dx + cy * dy;
      return [view.width / 2 + scale * across, view.height / 2 - scale * (cp * dz + sp * away)];
    };
  };

  const stroke = (places, width, color) => {
    pen.beginPath();
    places.forEach(([u, v], i) => (i ? pen.lineTo(u, v) : pen.moveTo(u, v)));
    pen.lineWidth = width;
    pen.strokeStyle = color;
    pen.stroke();
  };

  const draw = () => {
    const ratio = window.devicePixelRatio || 1;
    view.width = Math.round(view.clientWidth * ratio);
    view.height = Math.round(view.clientHeight * ratio);
    pen.lineCap = pen.lineJoin = "round";
    const at = project(), half = data.fork / 2;
    for (const x of [-half, half]) stroke([at(x, 0, 0), at(x, 0, -data.height)], 5 * ratio, "#c4c4c4");

    const frame = last(data.stamps, time), age = (time - data.stamps[frame]) / AGED;
    const grey = Math.round(34 + 140 * Math.min(Math.max(age, 0), 1));
    pen.fillStyle = `rgb(${grey},${grey},${grey})`;
    for (let i = first[frame]; i < first[frame + 1]; i++) {
      const [u, v] = at(cloud[3 * i], cloud[3 * i + 1], cloud[3 * i + 2]);
      pen.fillRect(u - ratio, v - ratio, 2 * ratio, 2 * ratio);
    }

    const state = Math.min(last(data.times, time), data.times.length - 2), n = data.nodes;
    const step = data.times[state + 1] - data.times[state];
    const part = Math.min(Math.max((time - data.times[state]) / step, 0), 1);
    const places = [];
    for (let i = 0; i < n; i++) {
      const a = 3 * (state * n + i), b = a + 3 * n;
      places.push(at(...[0, 1, 2].map((k) => (1 - part) * line[a + k] + part * line[b + k])));
    }
    stroke(places, 3.5 * ratio, data.color);

    slider.value = time;
    const sign = time < 0 ? "−" : "+";
    const far = Math.abs(time) >= 1;
    find("clock").textContent = "t = " + sign +
      (far ? `${Math.abs(time).toFixed(2)} s` : `${(1000 * Math.abs(time)).toFixed(1)} ms`);
  };

  const stop = () => {
    cancelAnimationFrame(playing);
    playing = null;
    find("play").textContent = "▶ play";
    find("play").setAttribute("aria-pressed", "false");
  };
  const play = () => {
    const [begin, end] = WINDOWS[find("part").value];
    if (time >= end) time = begin;
    let before = performance.now();
    find("play").textContent = "❚❚ pause";
    find("play").setAttribute("aria-pressed", "true");
    const step = (now) => {
      time = Math.min(time + Math.max(now - before, 0) / 1000 * Number(find("speed").value), end);
      before = now;
      draw();
      if (time >= end) stop(); else playing = requestAnimationFrame(step);
    };
    playing = requestAnimationFrame(step);
  };
  const choose = () => {
    const [begin, end] = WINDOWS[find("part").value];
    slider.min = begin;
    slider.max = end;
    time = Math.min(Math.max(time, begin), end);
    draw();
  };

  const turn = (across, up) => {
    yaw += across;
    pitch = Math.min(Math.max(pitch + up, -1.4), 1.57);
    draw();
  };
  let held = null;
  view.addEventListener("pointerdown", (event) => {
    held = [event.clientX, event.clientY];
    view.setPointerCapture(event.pointerId);
  });
  view.addEventListener("pointermove", (event) => {
    if (!held) return;
    turn(TURN * (held[0] - event.clientX), TURN * (event.clientY - held[1]));
    held = [event.clientX, event.clientY];
  });
  for (const name of ["pointerup", "pointercancel"]) view.addEventListener(name, () => { held = null; });
  const KEYS = { ArrowLeft: [KEY, 0], ArrowRight: [-KEY, 0], ArrowUp: [0, KEY], ArrowDown: [0, -KEY] };
  view.addEventListener("keydown", (event) => {
    if (event.key in KEYS) turn(...KEYS[event.key]);
    else if (event.key === " ") playing === null ? play() : stop();
    else return;
    event.preventDefault();
  });
  slider.addEventListener("input", () => { stop(); time = Number(slider.value); draw(); });
  find("play").addEventListener("click", () => (playing === null ? play() : stop()));
  find("next").addEventListener("click", () => {  // the first one again after the last
    stop();
    const [begin, end] = WINDOWS[find("part").value];
    const taken = data.stamps.filter((stamp) => stamp >= begin && stamp <= end);
    time = taken.find((stamp) => stamp > time + 1e-6) ?? taken[0] ?? time;
    draw();
  });
  find("part").addEventListener("change", () => {
    stop();
    find("speed").value = find("part").value === "all" ? "1" : "0.02";
    time = WINDOWS[find("part").value][0];
    choose();
  });
  addEventListener("resize", draw);
  choose();
})();
