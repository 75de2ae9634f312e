
// The surface is a cloud: vertices all around the band, as of a mesh. Its parts are rings, evenly along the unstretched band,
// and one of their VERTICES faces the camera. Wants the lists COSINES and SINES of the vertices' angles.

const float cosines[VERTICES] = COSINES, sines[VERTICES] = SINES;
for (int r = lane; r < PARTS; r += THREADS) {
  const float place = ((float)r + 0.5f) / (float)PARTS * rest_length;
  int e = 0;
  float before = 0.0f;
  while (e < EDGES - 1 && before + rest[e] <= place) before += rest[e++];
  const float at = (place - before) / rest[e];
  float centre[3], along[3], view[3], side[3], length2 = 0.0f, parallel = 0.0f, norm = 0.0f;
  for (int c = 0; c < 3; ++c) {
    along[c] = nodes[3 * e + 3 + c] - nodes[3 * e + c];
    centre[c] = nodes[3 * e + c] + at * along[c];
    view[c] = camera[c] - centre[c];
    length2 += along[c] * along[c];
  }
  const float length = ROOT_OF_ONE(length2);
  for (int c = 0; c < 3; ++c) {
    along[c] /= length + 1e-12f;
    parallel += view[c] * along[c];
  }
  for (int c = 0; c < 3; ++c) {
    view[c] -= parallel * along[c];
    norm += view[c] * view[c];
  }
  for (int c = 0; c < 3; ++c) view[c] /= ROOT_OF_ONE(norm) + 1e-12f;
  for (int c = 0; c < 3; ++c) side[c] = along[(c + 1) % 3] * view[(c + 2) % 3] - along[(c + 2) % 3] * view[(c + 1) % 3];
  const float thick = radius * ROOT_OF_ONE(rest[e] / (length > 0.25f * rest[e] ? length : 0.25f * rest[e]));
  for (int c = 0; c < 3; ++c) {
    surface[START + c][r] = surface[MIDDLE + c][r] = centre[c];
    surface[AXIS + c][r] = surface[ALONG + c][r] = 0.0f;
    for (int a = 0; a < VERTICES; ++a) surface[VERTEX + 3 * a + c][r] = centre[c] + thick * (cosines[a] * view[c] + sines[a] * side[c]);
  }
  surface[RADIUS][r] = 0.0f;
  surface[OFF][r] = surface[REACH][r] = MORE * thick + 1e-6f;
  surface[WEIGHT][r] = 1.0f;
}
SYNC();
const float weights = (float)(PARTS * VERTICES);

auto gap_to = [&](int part, real x, real y, real z) -> real {
  real nearest = zero + FAR;
  for (int a = 0; a < VERTICES; ++a) {
    const real square = square_to(&surface[VERTEX + 3 * a][part], x, y, z);
    nearest = square < nearest ? square : nearest;
  }
  return ROOT(nearest);
};
