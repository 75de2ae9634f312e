
// The surface is a cloud: vertices all around the band, as of a mesh. Its parts are rings, evenly along the unstretched band,
// and one of their VERTICES faces the camera. Wants the lists COSINES and SINES of the vertices' angles.

enum { AT = ALONG, REST };  // of a ring on its edge; the edge's length at rest
const float cosines[VERTICES] = COSINES, sines[VERTICES] = SINES;
int e = 0;
float before = 0.0f;
for (int r = lane; r < WIDE; r += THREADS) {
  const float place = ((float)r + 0.5f) / (float)PARTS * rest_length;
  while (e < EDGES - 1 && before + rest[e] <= place) before += rest[e++];
  surface[REST][r] = rest[e];
  surface[AT][r] = (place - before) / rest[e];
  for (int c = 0; c < 3; ++c) {
    surface[START + c][r] = nodes[3 * e + c];
    surface[AXIS + c][r] = nodes[3 * e + 3 + c] - nodes[3 * e + c];
  }
}
SYNC();
for (int r = 0; r < PARTS; r += LANES) {
  const real rest_of = GET(surface[REST] + r), at = GET(surface[AT] + r);
  real centre[3], along[3], view[3], side[3], length2 = zero, parallel = zero, norm = zero;
  for (int c = 0; c < 3; ++c) {
    along[c] = GET(surface[AXIS + c] + r);
    centre[c] = GET(surface[START + c] + r) + at * along[c];
    view[c] = camera[c] - centre[c];
    length2 += along[c] * along[c];
  }
  const real length = ROOT(length2), least_length = 0.25f * rest_of;
  for (int c = 0; c < 3; ++c) {
    along[c] /= length + 1e-12f;
    parallel += view[c] * along[c];
  }
  for (int c = 0; c < 3; ++c) {
    view[c] -= parallel * along[c];
    norm += view[c] * view[c];
  }
  for (int c = 0; c < 3; ++c) view[c] /= ROOT(norm) + 1e-12f;
  for (int c = 0; c < 3; ++c) side[c] = along[(c + 1) % 3] * view[(c + 2) % 3] - along[(c + 2) % 3] * view[(c + 1) % 3];
  const real thick = radius * ROOT(rest_of / (length > least_length ? length : least_length));
  for (int c = 0; c < 3; ++c) {
    PUT(surface[MIDDLE + c] + r, centre[c]);
    for (int a = 0; a < VERTICES; ++a) PUT(surface[VERTEX + 3 * a + c] + r, centre[c] + thick * (cosines[a] * view[c] + sines[a] * side[c]));
  }
  PUT(surface[RADIUS] + r, zero);
  PUT(surface[OFF] + r, MORE * thick + 1e-6f);
  PUT(surface[REACH] + r, MORE * thick + 1e-6f);
  PUT(surface[WEIGHT] + r, zero + 1.0f);
}
SYNC();
const float weights = (float)(PARTS * VERTICES);

auto square_to_axis = [&](int part, real x, real y, real z) -> real { return square_to(&surface[MIDDLE][part], x, y, z); };
#define AXIS_IS_MIDDLE 1
#define METRES(gap) ROOT(gap)
// Of points from a ring's vertices, squared: the least, and each
auto gap_to = [&](int part, real x, real y, real z, real (&squares)[VERTICES]) -> real {
  real nearest = zero + FAR;
  for (int a = 0; a < VERTICES; ++a) {
    squares[a] = square_to(&surface[VERTEX + 3 * a][part], x, y, z);
    nearest = squares[a] < nearest ? squares[a] : nearest;
  }
  return nearest;
};
