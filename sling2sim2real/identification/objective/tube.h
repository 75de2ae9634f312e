
// The surface is a tube around the centre line, thinner where it is stretched (constant volume). Its parts are the edges,
// with VERTICES on the ridge that faces the camera.

for (int e = 0; e < EDGES; e += LANES) {
  const int size = EDGES - e;
  real start[3], axis[3], along[3], length2 = zero;
  for (int c = 0; c < 3; ++c) {
    start[c] = taken(nodes + 3 * e + c, 3, size);
    axis[c] = taken(nodes + 3 * e + 3 + c, 3, size) - start[c];
    length2 += axis[c] * axis[c];
  }
  const real rest_of = taken(rest + e, 1, size), least2 = rest_of * rest_of * 0.0625f;
  const real square = length2 > least2 ? length2 : least2;  // a slack edge grows no thicker than twice
  const real thick = radius * ROOT(rest_of / ROOT(square));
  for (int c = 0; c < 3; ++c) {
    along[c] = axis[c] / square;
    PUT(surface[START + c] + e, start[c]);
    PUT(surface[AXIS + c] + e, axis[c]);
    PUT(surface[ALONG + c] + e, along[c]);
  }
  PUT(surface[RADIUS] + e, thick);
  PUT(surface[OFF] + e, 1e-5f * (ROOT(length2) + thick));
  PUT(surface[WEIGHT] + e, rest_of);
  real p[VERTICES][3], reach2 = zero;
  for (int k = 0; k < VERTICES; ++k) {
    const float at = ((float)k + 0.5f) / (float)VERTICES;
    real view[3], parallel = zero, norm = zero;
    for (int c = 0; c < 3; ++c) {
      p[k][c] = start[c] + at * axis[c];
      view[c] = camera[c] - p[k][c];
      parallel += view[c] * along[c];
    }
    for (int c = 0; c < 3; ++c) {
      view[c] -= parallel * axis[c];
      norm += view[c] * view[c];
    }
    norm = thick / ROOT(norm + 1e-12f);
    for (int c = 0; c < 3; ++c) {
      p[k][c] += norm * view[c];
      PUT(surface[VERTEX + 3 * k + c] + e, p[k][c]);
    }
  }
  for (int k = 0; k < VERTICES; ++k) {
    real square = zero;
    for (int c = 0; c < 3; ++c) square += (p[k][c] - p[VERTICES / 2][c]) * (p[k][c] - p[VERTICES / 2][c]);
    reach2 = square > reach2 ? square : reach2;
  }
  for (int c = 0; c < 3; ++c) PUT(surface[MIDDLE + c] + e, p[VERTICES / 2][c]);
  PUT(surface[REACH] + e, ROOT(reach2) * MORE);
}
SYNC();
const float weights = rest_length * (float)VERTICES;

auto square_to_axis = [&](int part, real x, real y, real z) -> real {
  const real dx = x - surface[START][part], dy = y - surface[START + 1][part], dz = z - surface[START + 2][part];
  real at = dx * surface[ALONG][part] + dy * surface[ALONG + 1][part] + dz * surface[ALONG + 2][part];
  at = at < 0.0f ? zero : at;
  at = at > 1.0f ? zero + 1.0f : at;
  const real ex = dx - at * surface[AXIS][part], ey = dy - at * surface[AXIS + 1][part], ez = dz - at * surface[AXIS + 2][part];
  return ex * ex + ey * ey + ez * ez;
};
#define AXIS_IS_MIDDLE 0
#define METRES(gap) gap
// Of points from a part's surface [m], and from its vertices, squared
auto gap_to = [&](int part, real x, real y, real z, real (&squares)[VERTICES]) -> real {
  for (int k = 0; k < VERTICES; ++k) squares[k] = square_to(&surface[VERTEX + 3 * k][part], x, y, z);
  return ROOT(square_to_axis(part, x, y, z)) - surface[RADIUS][part];
};
