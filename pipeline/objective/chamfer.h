// One camera frame of one rollout: mean distances between its points and the simulated tube, one
// text for 16 points a CPU vector and for 32 threads of a CUDA warp, a point each.
//
// Wants the macros EDGES, SAMPLES (an edge), BOTH (directions), CPU_LANES (as chamfer.py packs).
// In: line (N, K, EDGES + 1, 3), packed points: blocks of 4 rows x, y, z, weight (0: padding, a
// copy of a real point), frame_blocks (K + 1). Out: errors (N, K, 2) [m], measured to simulated and
// back; the first is NaN for an empty frame.

#if defined(__CUDA_ARCH__)
#define THREADS 32
#define LANES 32
#define SHARED __shared__
#define SYNC() __syncwarp()
typedef float real;
const int lane = tid % 32;
#define ROW(block, row) points.data[((size_t)(block) * 4 + (row)) * LANES + lane]
#define ROOT(x) sqrtf(x)
auto sum = [](float x) -> float { for (int o = 16; o > 0; o >>= 1) x += __shfl_xor_sync(0xffffffffu, x, o); return x; };
auto least = [](float x) -> float { for (int o = 16; o > 0; o >>= 1) x = fminf(x, __shfl_xor_sync(0xffffffffu, x, o)); return x; };
#else
#define THREADS 1
#define LANES CPU_LANES
#define SHARED
#define SYNC()
typedef float real __attribute__((vector_size(4 * LANES)));
const int lane = 0;
#define ROW(block, row) (*(const real*)(points.data + ((size_t)(block) * 4 + (row)) * LANES))
#define ROOT(x) root(x)
auto root = [](real x) -> real { for (int k = 0; k < LANES; ++k) x[k] = __builtin_sqrtf(x[k]); return x; };
auto sum = [](real x) -> float { float s = 0.0f; for (int k = 0; k < LANES; ++k) s += x[k]; return s; };
auto least = [](real x) -> float { float s = x[0]; for (int k = 1; k < LANES; ++k) s = x[k] < s ? x[k] : s; return s; };
#endif
const real zero = real() * 0.0f;

const int item = tid / THREADS, frame = item % frames;
const int first = frame_blocks.data[frame], last = frame_blocks.data[frame + 1];
const float* nodes = line.data + (size_t)item * (EDGES + 1) * 3;

const float* rest = rest_edges.data;
float rest_length = 0.0f;
for (int e = 0; e < EDGES; ++e) rest_length += rest[e];

// of each edge: start (3), vector (3), vector / length^2 (3), radius (stretched at constant volume)
SHARED float tube[EDGES][10];
SYNC();  // a block may have had another frame before
for (int e = lane; e < EDGES; e += THREADS) {
  float square = 0.0f;
  for (int c = 0; c < 3; ++c) {
    tube[e][c] = nodes[3 * e + c];
    tube[e][3 + c] = nodes[3 * e + 3 + c] - nodes[3 * e + c];
    square += tube[e][3 + c] * tube[e][3 + c];
  }
  const float least_square = rest[e] * rest[e] * 0.0625f;  // a slack edge grows no thicker than twice
  square = square > least_square ? square : least_square;
  for (int c = 0; c < 3; ++c) tube[e][6 + c] = tube[e][3 + c] / square;
  tube[e][9] = radius * sqrtf(rest[e] / sqrtf(square));
}
SYNC();

// measured to simulated: each point to the surface of the union of all edges' tubes
real total = zero, count = zero;
for (int b = first; b < last; ++b) {
  const real x = ROW(b, 0), y = ROW(b, 1), z = ROW(b, 2), weight = ROW(b, 3);
  real nearest = zero + 1e30f;
  for (int e = 0; e < EDGES; ++e) {
    const float* t = tube[e];
    const real dx = x - t[0], dy = y - t[1], dz = z - t[2];
    real part = dx * t[6] + dy * t[7] + dz * t[8];
    part = part < 0.0f ? zero : part;
    part = part > 1.0f ? zero + 1.0f : part;
    const real ex = dx - part * t[3], ey = dy - part * t[4], ez = dz - part * t[5];
    const real gap = ROOT(ex * ex + ey * ey + ez * ez) - t[9];
    nearest = gap < nearest ? gap : nearest;
  }
  total += weight * (nearest < 0.0f ? -nearest : nearest);
  count += weight;
}
const float measured = sum(total) / sum(count);
float simulated = 0.0f;

#if BOTH
// simulated to measured: points on the ridge of the tube that faces the camera, those of an edge at once
for (int e = 0; e < EDGES; ++e) {
  const float* t = tube[e];
  float p[SAMPLES][3];
  real nearest[SAMPLES];
  for (int k = 0; k < SAMPLES; ++k) {
    const float part = ((float)k + 0.5f) / (float)SAMPLES;
    float view[3], along = 0.0f, norm = 0.0f;
    for (int c = 0; c < 3; ++c) {
      p[k][c] = t[c] + part * t[3 + c];
      view[c] = camera[c] - p[k][c];
      along += view[c] * t[6 + c];
    }
    for (int c = 0; c < 3; ++c) { view[c] -= along * t[3 + c]; norm += view[c] * view[c]; }
    norm = t[9] / sqrtf(norm + 1e-12f);
    for (int c = 0; c < 3; ++c) p[k][c] += norm * view[c];
    nearest[k] = zero + 1e30f;
  }
  for (int b = first; b < last; ++b) {
    const real x = ROW(b, 0), y = ROW(b, 1), z = ROW(b, 2);
    for (int k = 0; k < SAMPLES; ++k) {
      const real dx = x - p[k][0], dy = y - p[k][1], dz = z - p[k][2];
      const real square = dx * dx + dy * dy + dz * dz;
      nearest[k] = square < nearest[k] ? square : nearest[k];
    }
  }
  for (int k = 0; k < SAMPLES; ++k) simulated += sqrtf(least(nearest[k])) * rest[e];  // each for its share
}
simulated /= rest_length * (float)SAMPLES;
#endif
if (lane == 0) { errors.data[2 * (size_t)item] = measured; errors.data[2 * (size_t)item + 1] = simulated; }

#undef THREADS
#undef LANES
#undef SHARED
#undef SYNC
#undef ROW
#undef ROOT
