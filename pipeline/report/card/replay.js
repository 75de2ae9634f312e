"use strict";
// The camera's points and the simulated band, moment by moment, and launches. Reads the JSON in #data
// (pipeline/report/card/page.py): times in seconds from the release, places in millimetres, frame O.
(() => {
  const find = (id) => document.getElementById(id);
  const data = JSON.parse(find("data").textContent);
  const view = find("view"), slider = find("moment"), pen = view.getContext("2d");
  const whole = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Int16Array(bytes.buffer);
  };
  const line = whole(data.line), cloud = whole(data.cloud), hand = whole(data.hand), first = [0];
  for (const count of data.counts) first.push(first[first.length - 1] + count);
  const WINDOWS = { release: data.release, all: [data.times[0], data.times[data.times.length - 1]] };
  const HELD = 0.6, LANDED = 0.6;  // s before and after a flight that are shown
  const part = find("part");
  data.launches.forEach((one, i) => {
    const points = Math.max(...one.flights.map((way) => way.length / 2), 1);
    WINDOWS["launch" + i] = [-HELD, (points - 1) * one.step + LANDED];
    part.add(new Option(`${one.kind} launches at ${(one.target / 1000).toFixed(2)} m`, "launch" + i));
  });
  const shown = () => (part.value.startsWith("launch") ? data.launches[part.value.slice(6)] : null);
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
    const one = shown();
    const far = one && Math.max(one.target, ...one.landings, ...(one.interval || [])) + 200;
    const size = one ? far - one.draw[0] + 200 : data.size;
    const [x0, y0, z0] = one ? [0, (far + one.draw[0]) / 2, -data.height / 2] : data.centre;
    const scale = Math.min(view.width, view.height / (one ? 0.4 : 0.8)) / size;
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

  const dot = ([u, v], size, color) => {
    pen.fillStyle = color;
    pen.fillRect(u - size / 2, v - size / 2, size, size);
  };

  const floor = (at, ratio) => {  // a grid of half metres
    const [low, high] = shown() ? [-500, 3000] : [-500, 500];
    for (let y = low; y <= high; y += 500)
      stroke([at(-500, y, -data.height), at(500, y, -data.height)], ratio, "#e6e6e6");
    for (let x = -500; x <= 500; x += 500)
      stroke([at(x, low, -data.height), at(x, high, -data.height)], ratio, "#e6e6e6");
  };

  const launches = (one, at, ratio) => {
    const half = data.fork / 2, z = -data.height;
    stroke([at(0, one.target, z), at(0, one.target, z + 120)], 2 * ratio, "#222222");
    if (one.interval)
      stroke(one.interval.map((y) => at(0, y, z)), 6 * ratio, data.color);
    if (time < 0) {
      const held = [0, ...one.draw];
      stroke([at(-half, 0, 0), at(...held), at(half, 0, 0)], 3.5 * ratio, data.color);
      dot(at(...held), 12 * ratio, "#555555");
      return;
    }
    for (const way of one.flights) {
      const many = Math.min(Math.floor(time / (one.step || 1)) + 1, way.length / 2);
      const places = Array.from({ length: many }, (_, i) => at(0, way[2 * i], way[2 * i + 1]));
      stroke(places, 1.5 * ratio, "#9a9a9a");
      dot(places[places.length - 1], 7 * ratio, "#222222");
    }
    if (!one.flights.length) for (const y of one.landings) dot(at(0, y, z), 7 * ratio, "#222222");
  };

  const pull = (at, ratio) => {
    const frame = last(data.stamps, time), age = (time - data.stamps[frame]) / AGED;
    const grey = Math.round(34 + 140 * Math.min(Math.max(age, 0), 1));
    pen.fillStyle = `rgb(${grey},${grey},${grey})`;
    for (let i = first[frame]; i < first[frame + 1]; i++) {
      const [u, v] = at(cloud[3 * i], cloud[3 * i + 1], cloud[3 * i + 2]);
      pen.fillRect(u - ratio, v - ratio, 2 * ratio, 2 * ratio);
    }

    const state = Math.min(last(data.times, time), data.times.length - 2), n = data.nodes;
    const step = data.times[state + 1] - data.times[state];
    const share = Math.min(Math.max((time - data.times[state]) / step, 0), 1);
    const places = [];
    for (let i = 0; i < n; i++) {
      const a = 3 * (state * n + i), b = a + 3 * n;
      places.push(at(...[0, 1, 2].map((k) => (1 - share) * line[a + k] + share * line[b + k])));
    }
    stroke(places, 3.5 * ratio, data.color);

    const moved = 3 * last(data.moved, time);
    if (time >= data.grasp - 1)
      dot(at(hand[moved], hand[moved + 1], hand[moved + 2]), 10 * ratio, "rgba(85, 85, 85, 0.7)");
  };

  const draw = () => {
    const ratio = window.devicePixelRatio || 1;
    view.width = Math.round(view.clientWidth * ratio);
    view.height = Math.round(view.clientHeight * ratio);
    pen.lineCap = pen.lineJoin = "round";
    const at = project(), half = data.fork / 2, launch = shown();
    floor(at, ratio);
    for (const x of [-half, half]) stroke([at(x, 0, 0), at(x, 0, -data.height)], 5 * ratio, "#c4c4c4");

    if (launch) launches(launch, at, ratio); else pull(at, ratio);

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
    const [begin, end] = WINDOWS[part.value];
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
    const [begin, end] = WINDOWS[part.value];
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
    const [begin, end] = WINDOWS[part.value];
    const taken = data.stamps.filter((stamp) => stamp >= begin && stamp <= end);
    time = taken.find((stamp) => stamp > time + 1e-6) ?? taken[0] ?? time;
    draw();
  });
  part.addEventListener("change", () => {
    stop();
    find("speed").value = { release: "0.02", all: "1" }[part.value] ?? "0.1";
    time = WINDOWS[part.value][0];
    [yaw, pitch] = shown() ? [1.45, 0.12] : [0.95, 0.5];  // launches from the side
    find("next").disabled = Boolean(shown());
    choose();
  });
  addEventListener("resize", draw);
  choose();
})();
