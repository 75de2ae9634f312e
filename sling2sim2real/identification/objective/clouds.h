
// Mean distances between a frame's points and the vertices of the simulated surface, as between two clouds. After
// points.h; wants the macros RINGS and AROUND, whose product are the vertices, and the lists COSINES and SINES (AROUND)
// too.

enum { RING_WORDS = (RINGS + 31) / 32 };
const float cosines[AROUND] = COSINES, sines[AROUND] = SINES;
SHARED float ring[4][RINGS], vertex[3][RINGS][AROUND];  // centre, and how far off its vertices are
float whole_length = 0.0f, broken = 0.0f;
for (int e = 0; e < EDGES; ++e) whole_length += rest_edges.data[e];
for (int n = 0; n < 3 * (EDGES + 1); ++n) broken += 0.0f * nodes[n];  // NaN where a node is not finite
SYNC();  // a block may have had another frame before
for (int r = lane; r < RINGS; r += THREADS) {
  const float at = ((float)r + 0.5f) / (float)RINGS * whole_length;  // evenly along the unstretched band
  int e = 0;
  float before = 0.0f;
  while (e < EDGES - 1 && before + rest_edges.data[e] <= at) before += rest_edges.data[e++];
  const float rest = rest_edges.data[e], part = (at - before) / rest;
  float along[3], view[3], side[3], length2 = 0.0f, turned = 0.0f, norm = 0.0f;
  for (int c = 0; c < 3; ++c) {
    along[c] = nodes[3 * e + 3 + c] - nodes[3 * e + c];
    ring[c][r] = nodes[3 * e + c] + part * along[c];
    view[c] = camera[c] - ring[c][r];
    length2 += along[c] * along[c];
  }
  const float length = ROOT_OF_ONE(length2);
  for (int c = 0; c < 3; ++c) { along[c] /= length + 1e-12f; turned += view[c] * along[c]; }
  for (int c = 0; c < 3; ++c) { view[c] -= turned * along[c]; norm += view[c] * view[c]; }
  for (int c = 0; c < 3; ++c) view[c] /= ROOT_OF_ONE(norm) + 1e-12f;  // one vertex faces the camera
  for (int c = 0; c < 3; ++c) side[c] = along[(c + 1) % 3] * view[(c + 2) % 3] - along[(c + 2) % 3] * view[(c + 1) % 3];
  const float thick = radius * ROOT_OF_ONE(rest / (length > 0.25f * rest ? length : 0.25f * rest));  // as in chamfer.h
  ring[3][r] = MORE * thick + 1e-6f;
  for (int a = 0; a < AROUND; ++a)
    for (int c = 0; c < 3; ++c) vertex[c][r][a] = ring[c][r] + thick * (cosines[a] * view[c] + sines[a] * side[c]);
}
SYNC();

auto apart = [&](int r, real x, real y, real z) -> real {
  const real dx = x - ring[0][r], dy = y - ring[1][r], dz = z - ring[2][r];
  return ROOT(dx * dx + dy * dy + dz * dz);
};
auto square_to = [&](int r, int a, real x, real y, real z) -> real {
  const real dx = x - vertex[0][r][a], dy = y - vertex[1][r][a], dz = z - vertex[2][r][a];
  return dx * dx + dy * dy + dz * dz;
};

// measured to simulated: which rings can hold the vertex that is nearest to a point of a ball; then each point
real total = zero, count = zero;
SHARED unsigned near[RING_WORDS][LANES];  // of each ball of a group, a bit for a ring
for (int g = first_group; g < last_group; ++g) {
  const real x = ROW(balls, g, 0), y = ROW(balls, g, 1), z = ROW(balls, g, 2), ball = ROW(balls, g, 3);
  real limit = zero + FAR;
  for (int r = 0; r < RINGS; ++r) {
    const real upper = apart(r, x, y, z) * MORE + ring[3][r];
    limit = upper < limit ? upper : limit;
  }
  limit += CULLED ? 2.0f * ball : zero + INFINITE;
  whole bits_of_rings[RING_WORDS] = {};
  for (int r = 0; r < RINGS; ++r)
    bits_of_rings[r / 32] |= apart(r, x, y, z) * LESS - ring[3][r] > limit ? whole() : whole() + (1u << r % 32);
  SYNC();  // the group before may be read still
  for (int word = 0; word < RING_WORDS; ++word) PUT(near[word], bits_of_rings[word]);
  SYNC();

  const int begin = first + (g - first_group) * LANES;
  const int size = last - begin < LANES ? last - begin : LANES;
  for (int k = 0; k < size; ++k) {
    const int b = begin + k;
    const real x = ROW(points, b, 0), y = ROW(points, b, 1), z = ROW(points, b, 2), weight = ROW(points, b, 3);
    real nearest = zero + FAR;
    for (int word = 0; word < RING_WORDS; ++word)
      for (unsigned bits = near[word][k]; bits; bits &= bits - 1) {
        const int r = 32 * word + FIRST_BIT(bits);
        for (int a = 0; a < AROUND; ++a) {
          const real square = square_to(r, a, x, y, z);
          nearest = square < nearest ? square : nearest;
        }
      }
    total += weight * ROOT(nearest);
    count += weight;
  }
}
const float measured = sum(total) / sum(count) + broken;

// simulated to measured: which blocks can hold the point that is nearest to a vertex of a ring; then each vertex
float simulated = broken;
for (int r = 0; r < RINGS; ++r) {
  real limits = zero + FAR, nearest[AROUND];
  for (int g = first_group; g < last_group; ++g) {
    const real upper = apart(r, ROW(balls, g, 0), ROW(balls, g, 1), ROW(balls, g, 2)) * MORE + ROW(balls, g, 3);
    limits = upper < limits ? upper : limits;
  }
  const float limit = least(limits) + (CULLED ? 2.0f * ring[3][r] : INFINITE);
  for (int a = 0; a < AROUND; ++a) nearest[a] = zero + FAR;
  for (int g = first_group; g < last_group; ++g) {
    const int begin = first + (g - first_group) * LANES;
    const real lower = apart(r, ROW(balls, g, 0), ROW(balls, g, 1), ROW(balls, g, 2)) * LESS - ROW(balls, g, 3);
    const unsigned there = last - begin < LANES ? (1u << (last - begin)) - 1 : ~0u;
    for (unsigned bits = BITS(lower <= limit) & there; bits; bits &= bits - 1) {
      const int b = begin + FIRST_BIT(bits);
      const real x = ROW(points, b, 0), y = ROW(points, b, 1), z = ROW(points, b, 2);
      for (int a = 0; a < AROUND; ++a) {
        const real square = square_to(r, a, x, y, z);
        nearest[a] = square < nearest[a] ? square : nearest[a];
      }
    }
  }
  for (int a = 0; a < AROUND; ++a) simulated += ROOT_OF_ONE(least(nearest[a]));
}
simulated /= (float)(RINGS * AROUND);
if (lane == 0) { errors.data[2 * (size_t)item] = measured; errors.data[2 * (size_t)item + 1] = simulated; }
