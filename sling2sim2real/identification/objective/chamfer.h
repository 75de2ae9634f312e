
// The Chamfer distance of a frame, in both directions, errors (N, K, 2) [m]:
//
//   measured   mean over points of | least over parts of their distance from the part's surface |, NaN without points
//   simulated  mean over vertices of the distance of the nearest point
//
// Both come from the same pairs of a block of points and a part. Balls, LANES of them at once, tell which pairs cannot hold a
// nearest distance; these are skipped, which changes no bit (CULLED 0: none is).

enum { BLOCKS = 64, GROUPS = BLOCKS / LANES };  // at a time
SHARED unsigned part_of[BLOCKS];                // the part that is nearest to a block's ball
SHARED float reach[BLOCKS];                     // no part whose surface is farther is the nearest to one of its points
for (int part = lane; part < WIDE; part += THREADS) {
  if (part >= PARTS) surface[WEIGHT][part] = 0.0f;
  for (int k = 0; k < VERTICES; ++k) surface[NEAREST + k][part] = part < PARTS ? FAR : 0.0f;
}
real total = zero, count = zero;
for (int from = first; from < last; from += BLOCKS) {
  const int size = last - from < BLOCKS ? last - from : BLOCKS;
  const int groups = (size + LANES - 1) / LANES, first_ball = first_group + (from - first) / LANES;
  auto there = [&](int g) -> unsigned { return size - g * LANES < LANES ? (1u << (size - g * LANES)) - 1 : ~0u; };
  real nearest[BLOCKS];  // of each point, as `gap_to` has it
  SYNC();
  for (int g = 0; g < groups; ++g) {
    real best = zero + FAR;
    whole found = whole();
    for (int part = 0; part < PARTS; ++part) {
      const real square = square_to_axis(part, PLACE(balls, first_ball + g));
      found = square < best ? whole() + (unsigned)part : found;
      best = square < best ? square : best;
    }
    PUT(part_of + g * LANES, found);
  }
  SYNC();
  for (int b = 0; b < size; ++b) {
    real squares[VERTICES];
    nearest[b] = gap_to(part_of[b], PLACE(points, from + b), squares);
    const float farthest = -least(-METRES(nearest[b]));
    if (lane == 0) reach[b] = CULLED ? farthest : INFINITE;
  }
  SYNC();
  for (int part = 0; part < PARTS; ++part) {
    // the block that is nearest first: all vertices are near to one of its points, and so to their nearest ones
    real middle[GROUPS], closest = zero + FAR;
    for (int g = 0; g < groups; ++g) {
      middle[g] = square_to(&surface[MIDDLE][part], PLACE(balls, first_ball + g));
      closest = middle[g] < closest ? middle[g] : closest;
    }
    const float square_of_closest = least(closest);
    int start = 0;
    for (int g = 0; g < groups; ++g) {
      const unsigned bits = BITS(middle[g] <= zero + square_of_closest) & there(g);
      start = bits ? g * LANES + FIRST_BIT(bits) : start;
    }
    real vertices[VERTICES], farthest = zero;
    const real gap = gap_to(part, PLACE(points, from + start), vertices);
    nearest[start] = gap < nearest[start] ? gap : nearest[start];
    for (int k = 0; k < VERTICES; ++k) farthest = vertices[k] > farthest ? vertices[k] : farthest;
    const float within = CULLED ? MORE * ROOT_OF_ONE(least(farthest)) + surface[REACH][part] : INFINITE;
    const float thick = surface[RADIUS][part] + surface[OFF][part];
    for (int g = 0; g < groups; ++g) {
      const real ball = ROW(balls, first_ball + g, 3), of_points = GET(reach + g * LANES) + ball + thick, of_vertices = within + ball;
      const real axis = AXIS_IS_MIDDLE ? middle[g] : square_to_axis(part, PLACE(balls, first_ball + g));
      const auto may = (axis * LESS <= of_points * of_points) | (middle[g] * LESS <= of_vertices * of_vertices);
      unsigned bits = BITS(may) & there(g);
      if (start / LANES == g) bits &= ~(1u << start % LANES);
      for (; bits; bits &= bits - 1) {
        const int b = g * LANES + FIRST_BIT(bits);
        real squares[VERTICES];
        const real gap = gap_to(part, PLACE(points, from + b), squares);
        nearest[b] = gap < nearest[b] ? gap : nearest[b];
        for (int k = 0; k < VERTICES; ++k) vertices[k] = squares[k] < vertices[k] ? squares[k] : vertices[k];
      }
    }
    for (int k = 0; k < VERTICES; ++k) {
      const float before = surface[NEAREST + k][part], here = least(vertices[k]);
      if (lane == 0) surface[NEAREST + k][part] = here < before ? here : before;
    }
  }
  for (int b = 0; b < size; ++b) {
    const real weight = ROW(points, from + b, 3), away = METRES(nearest[b]);
    total += weight * (away < 0.0f ? -away : away);
    count += weight;
  }
}
const float measured = sum(total) / sum(count) + broken;
SYNC();
real shares = zero;
for (int part = 0; part < PARTS; part += LANES)
  for (int k = 0; k < VERTICES; ++k) shares += ROOT(GET(surface[NEAREST + k] + part)) * GET(surface[WEIGHT] + part);
const float simulated = sum(shares) / weights + broken;
if (lane == 0) {
  errors.data[2 * (size_t)item] = measured;
  errors.data[2 * (size_t)item + 1] = simulated;
}
