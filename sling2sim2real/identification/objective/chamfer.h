
// Mean distances between a frame's points and the simulated tube. After points.h; wants the macro SAMPLES (an edge)
// too.

const float* rest = rest_edges.data;
float rest_length = 0.0f;
for (int e = 0; e < EDGES; ++e) rest_length += rest[e];

// of each edge: start (3), vector (3), vector / length^2 (3), radius (stretched at constant volume), how
// far off a bound may be, how far its samples reach from the middle one, samples (3 each) and how far the
// nearest point is from each, squared
enum { RADIUS = 9, OFF, REACH, RIDGE, NEAREST = RIDGE + 3 * SAMPLES, ROWS = NEAREST + SAMPLES, WIDE = (EDGES + LANES - 1) / LANES * LANES, WORDS = (EDGES + 31) / 32 };
SHARED float tube[ROWS][WIDE];
SYNC();  // a block may have had another frame before
for (int e = 0; e < EDGES; e += LANES) {
  const int size = EDGES - e;
  real start[3], edge[3], part[3], length2 = zero;
  for (int c = 0; c < 3; ++c) {
    start[c] = taken(nodes + 3 * e + c, 3, size);
    edge[c] = taken(nodes + 3 * e + 3 + c, 3, size) - start[c];
    length2 += edge[c] * edge[c];
  }
  const real rest_of = taken(rest + e, 1, size), least2 = rest_of * rest_of * 0.0625f;
  const real square = length2 > least2 ? length2 : least2;  // a slack edge grows no thicker than twice
  const real thick = radius * ROOT(rest_of / ROOT(square));
  for (int c = 0; c < 3; ++c) {
    part[c] = edge[c] / square;
    PUT(tube[c] + e, start[c]);
    PUT(tube[3 + c] + e, edge[c]);
    PUT(tube[6 + c] + e, part[c]);
  }
  PUT(tube[RADIUS] + e, thick);
  PUT(tube[OFF] + e, 1e-5f * (ROOT(length2) + thick));
  // points on the ridge of the tube that faces the camera
  real p[SAMPLES][3], reach2 = zero;
  for (int k = 0; k < SAMPLES; ++k) {
    const float at = ((float)k + 0.5f) / (float)SAMPLES;
    real view[3], along = zero, norm = zero;
    for (int c = 0; c < 3; ++c) {
      p[k][c] = start[c] + at * edge[c];
      view[c] = camera[c] - p[k][c];
      along += view[c] * part[c];
    }
    for (int c = 0; c < 3; ++c) { view[c] -= along * edge[c]; norm += view[c] * view[c]; }
    norm = thick / ROOT(norm + 1e-12f);
    for (int c = 0; c < 3; ++c) { p[k][c] += norm * view[c]; PUT(tube[RIDGE + 3 * k + c] + e, p[k][c]); }
  }
  for (int k = 0; k < SAMPLES; ++k) {
    real square = zero;
    for (int c = 0; c < 3; ++c) square += (p[k][c] - p[SAMPLES / 2][c]) * (p[k][c] - p[SAMPLES / 2][c]);
    reach2 = square > reach2 ? square : reach2;
  }
  PUT(tube[REACH] + e, ROOT(reach2) * MORE);
  for (int k = 0; k < SAMPLES; ++k) PUT(tube[NEAREST + k] + e, zero + FAR);
}
SYNC();

auto to_axis = [&](int e, real x, real y, real z) -> real {
  const real dx = x - tube[0][e], dy = y - tube[1][e], dz = z - tube[2][e];
  real part = dx * tube[6][e] + dy * tube[7][e] + dz * tube[8][e];
  part = part < 0.0f ? zero : part;
  part = part > 1.0f ? zero + 1.0f : part;
  const real ex = dx - part * tube[3][e], ey = dy - part * tube[4][e], ez = dz - part * tube[5][e];
  return ROOT(ex * ex + ey * ey + ez * ez);
};

// measured to simulated: each point to the surface of the union of all edges' tubes
real total = zero, count = zero;
SHARED unsigned near[WORDS][LANES];  // of each ball of a group, a bit for an edge
for (int g = first_group; g < last_group; ++g) {
  // which edges can be nearest to a point in a ball: the others are farther by more than its width
  const real x = ROW(balls, g, 0), y = ROW(balls, g, 1), z = ROW(balls, g, 2), ball = ROW(balls, g, 3);
  real lower[EDGES], limit = zero + FAR;
  UNROLL for (int e = 0; e < EDGES; ++e) {
    const real away = to_axis(e, x, y, z);
    const real upper = away * MORE - (tube[RADIUS][e] - tube[OFF][e]);
    lower[e] = away * LESS - (tube[RADIUS][e] + tube[OFF][e]);
    limit = upper < limit ? upper : limit;
  }
  limit += CULLED ? 2.0f * ball : zero + INFINITE;
  whole bits_of_edges[WORDS] = {};
  UNROLL for (int e = 0; e < EDGES; ++e) bits_of_edges[e / 32] |= lower[e] > limit ? whole() : whole() + (1u << e % 32);
  SYNC();  // the group before may be read still
  for (int word = 0; word < WORDS; ++word) PUT(near[word], bits_of_edges[word]);
  SYNC();

  const int begin = first + (g - first_group) * LANES;
  const int size = last - begin < LANES ? last - begin : LANES;
  for (int k = 0; k < size; ++k) {
    const int b = begin + k;
    const real x = ROW(points, b, 0), y = ROW(points, b, 1), z = ROW(points, b, 2), weight = ROW(points, b, 3);
    real nearest = zero + FAR;
    for (int word = 0; word < WORDS; ++word)
      for (unsigned bits = near[word][k]; bits; bits &= bits - 1) {
        const int e = 32 * word + FIRST_BIT(bits);
        const real gap = to_axis(e, x, y, z) - tube[RADIUS][e];
        nearest = gap < nearest ? gap : nearest;
      }
    total += weight * (nearest < 0.0f ? -nearest : nearest);
    count += weight;
  }
}
const float measured = sum(total) / sum(count);

// simulated to measured, 64 blocks at once: which can be nearest to the samples of an edge, by some ball that
// is near the middle one of them; then each sample to the nearest point
SHARED unsigned long long within[EDGES];
for (int g = first_group; g < last_group; g += 64 / LANES) {
  const int begin = first + (g - first_group) * LANES;
  const unsigned long long there = last - begin < 64 ? (1ull << (last - begin)) - 1 : ~0ull;
  for (int e = 0; e < EDGES; ++e) {
    const float* m = &tube[RIDGE + 3 * (SAMPLES / 2)][e];
    real away[64 / LANES], ball[64 / LANES], limits = zero + FAR;
    UNROLL for (int more = 0; more < 64 / LANES; ++more) {
      const int group = g + more < last_group ? g + more : last_group - 1;
      const real dx = ROW(balls, group, 0) - m[0], dy = ROW(balls, group, 1) - m[WIDE], dz = ROW(balls, group, 2) - m[2 * WIDE];
      away[more] = ROOT(dx * dx + dy * dy + dz * dz);
      ball[more] = ROW(balls, group, 3);
      const real upper = away[more] * MORE + ball[more];
      limits = upper < limits ? upper : limits;
    }
    const float limit = least(limits) + (CULLED ? 2.0f * tube[REACH][e] : INFINITE);
    unsigned long long bits = 0;
    UNROLL for (int more = 0; more < 64 / LANES; ++more)
      bits |= (unsigned long long)BITS(away[more] * LESS - ball[more] <= limit) << (more * LANES);
    if (lane == 0) within[e] = bits & there;
  }
  SYNC();
  for (int e = 0; e < EDGES; ++e) {
    float p[SAMPLES][3];
    real nearest[SAMPLES];
    for (int k = 0; k < SAMPLES; ++k) {
      for (int c = 0; c < 3; ++c) p[k][c] = tube[RIDGE + 3 * k + c][e];
      nearest[k] = zero + tube[NEAREST + k][e];
    }
    for (unsigned long long bits = within[e]; bits; bits &= bits - 1) {
      const int b = begin + FIRST_BIT(bits);
      const real x = ROW(points, b, 0), y = ROW(points, b, 1), z = ROW(points, b, 2);
      for (int k = 0; k < SAMPLES; ++k) {
        const real dx = x - p[k][0], dy = y - p[k][1], dz = z - p[k][2];
        const real square = dx * dx + dy * dy + dz * dz;
        nearest[k] = square < nearest[k] ? square : nearest[k];
      }
    }
    for (int k = 0; k < SAMPLES; ++k) {
      const float square = least(nearest[k]);
      if (lane == 0) tube[NEAREST + k][e] = square;
    }
  }
  SYNC();
}
for (int e = EDGES + lane; e < WIDE; e += THREADS)
  for (int k = 0; k < SAMPLES; ++k) tube[NEAREST + k][e] = 0.0f;
SYNC();
real shares = zero;  // each sample's for its edge's
for (int e = 0; e < EDGES; e += LANES)
  for (int k = 0; k < SAMPLES; ++k) shares += ROOT(GET(tube[NEAREST + k] + e)) * taken(rest + e, 1, EDGES - e);
const float simulated = sum(shares) / (rest_length * (float)SAMPLES);
if (lane == 0) { errors.data[2 * (size_t)item] = measured; errors.data[2 * (size_t)item + 1] = simulated; }

