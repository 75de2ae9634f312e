// One text for both devices: the lanes of a CPU's vector, or the 32 threads of a CUDA warp, hold a point or an edge each.
// The macros and names below are all that differs.

#if defined(__CUDA_ARCH__)
#define THREADS 32
#define LANES 32
#define SHARED __shared__
#define SYNC() __syncwarp()
typedef float real;
typedef unsigned whole;
const int lane = tid % 32;
#define ROW(array, block, row) array.data[((size_t)(block) * 4 + (row)) * LANES + lane]
#define ROOT(x) sqrtf(x)
#define ROOT_OF_ONE(x) sqrtf(x)
#define GET(array) (array)[lane]
#define PUT(array, x) (array)[lane] = x
#define BITS(x) __ballot_sync(0xffffffffu, x)
#define FIRST_BIT(bits) (__ffsll(bits) - 1)
#define UNROLL _Pragma("unroll")  // arrays over edges lie in registers
auto taken = [=](const float* array, int stride, int size) -> float { return array[stride * (lane < size ? lane : size - 1)]; };
auto sum = [](float x) -> float { for (int o = 16; o > 0; o >>= 1) x += __shfl_xor_sync(0xffffffffu, x, o); return x; };
auto least = [](float x) -> float { for (int o = 16; o > 0; o >>= 1) x = fminf(x, __shfl_xor_sync(0xffffffffu, x, o)); return x; };
#else
#define THREADS 1
#define LANES CPU_LANES
#define SHARED alignas(4 * LANES)
#define SYNC()
typedef float real __attribute__((vector_size(4 * LANES)));
typedef unsigned whole __attribute__((vector_size(4 * LANES)));
typedef bool flags __attribute__((ext_vector_type(LANES)));
const int lane = 0;
#define ROW(array, block, row) (*(const real*)(array.data + ((size_t)(block) * 4 + (row)) * LANES))
#define ROOT(x) root(x)
#define ROOT_OF_ONE(x) __builtin_sqrtf(x)  // of a number, not of a vector
#define GET(array) (*(const real*)(array))
#define PUT(array, x) put(array, x)
#define BITS(x) bits_of(__builtin_convertvector(x, flags))
#define FIRST_BIT(bits) __builtin_ctzll(bits)
#define UNROLL
auto taken = [](const float* array, int stride, int size) -> real { real x; for (int k = 0; k < LANES; ++k) x[k] = array[stride * (k < size ? k : size - 1)]; return x; };
auto put = [](auto* array, auto x) { *(decltype(x)*)array = x; };
auto bits_of = [](flags x) -> unsigned { unsigned bits = 0; __builtin_memcpy(&bits, &x, sizeof(x)); return bits; };
auto root = [](real x) -> real { return __builtin_elementwise_sqrt(x); };
auto sum = [](real x) -> float { float s = 0.0f; for (int k = 0; k < LANES; ++k) s += x[k]; return s; };
auto least = [](real x) -> float {
  _Pragma("clang loop unroll(full)")
  for (int width = LANES / 2; width > 0; width /= 2) {
    real other;
    for (int k = 0; k < LANES; ++k) other[k] = x[(k + width) % LANES];
    x = other < x ? other : x;
  }
  return x[0];
};
#endif
#define PLACE(array, block) ROW(array, block, 0), ROW(array, block, 1), ROW(array, block, 2)
const real zero = real() * 0.0f;
#define FAR 1e30f
#define INFINITE (FAR * FAR)
#define LESS 0.99999f  // bounds are this much wider than rounding could ask for
#define MORE 1.00001f


// A thread (or warp) has one camera frame of one rollout. Its measured points are blocks of LANES, each within a ball; balls
// come in groups of LANES. The simulated surface has PARTS, each with VERTICES:
const int item = tid / THREADS, frame = item % frames;
const int first = frame_blocks.data[frame], last = frame_blocks.data[frame + 1];
const int first_group = frame_groups.data[frame], last_group = frame_groups.data[frame + 1];
const float* nodes = line.data + (size_t)item * (EDGES + 1) * 3;
const float* rest = rest_edges.data;
float rest_length = 0.0f;
for (int e = 0; e < EDGES; ++e) rest_length += rest[e];
float broken = 0.0f;
for (int n = 0; n < 3 * (EDGES + 1); ++n) broken += 0.0f * nodes[n];  // NaN where a node is not finite

enum {
  START = 0,          // of a part's axis, and
  AXIS = 3,           // its vector; none of a ring
  ALONG = 6,          // the same over its squared length
  RADIUS = 9,         // of the surface around the axis, within
  OFF,                // as much as that
  MIDDLE,             // of the vertices, which lie within
  REACH = MIDDLE + 3,
  WEIGHT,             // of each vertex
  VERTEX,             // 3 rows each
  NEAREST = VERTEX + 3 * VERTICES,  // distance of a measured point from each, squared
  ROWS = NEAREST + VERTICES,
  WIDE = (PARTS + LANES - 1) / LANES * LANES,
};
SHARED float surface[ROWS][WIDE];
SYNC();  // a block may have had another frame before

auto square_to = [&](const float* point, real x, real y, real z) -> real {
  const real dx = x - point[0], dy = y - point[WIDE], dz = z - point[2 * WIDE];
  return dx * dx + dy * dy + dz * dz;
};
