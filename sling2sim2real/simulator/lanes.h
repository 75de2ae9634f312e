// How slings lie over threads: all that differs between the two kinds of device.
//
// On a CPU a thread steps WIDTH slings in its SIMD lanes: `real` is a vector of WIDTH numbers, and one chain eliminates from
// the first section to the last. On a GPU `real` is one number, and the TEAM = 32 threads of a warp share a sling: each
// stages some sections, and two chains of DOFS + 1 threads, a column of the blocks each, eliminate from both ends.
//
// Wants the macros scalar (float or double), WIDTH, SECTIONS, MIDDLE (the held section), DOFS (of a section).

#if defined(__CUDA_ARCH__)
typedef scalar real;
#define TEAM 32
#define MEET MIDDLE                                       // section where the chains meet
#define COLUMNS 1                                         // of a block, and of its residual, that a thread has
#define REUSES_FACTORS false                              // whether Newton's method may freeze its Hessian
const int sling = tid / TEAM, member = tid % TEAM;
const int first_of_chain = member > DOFS ? DOFS + 1 : 0;  // a thread
const int first_column = member - first_of_chain;         // of this thread; of spare threads more than DOFS
const bool backwards = member > DOFS;                     // this chain begins at the last section
#define OF_SLING(array, size) (array.data + (size_t)sling * (size))
#define LOWER_PART_FROM(column) 0                         // a thread has its column whole
#define ENTRY(columns, column, row) __shfl_sync(~0u, columns[0][row], first_of_chain + (column))
#define ROW_OF_OWN(columns, row, q) columns[0][row]
#define OF_COLUMN(values, column) __shfl_sync(~0u, values[0], first_of_chain + (column))
#define WAIT_FOR_TEAM __syncwarp()
#define ALL(mask) __all_sync(~0u, mask)
#define SQRT(x) sqrt(x)
#define UNROLL _Pragma("unroll")
#define INLINED
auto team_maximum = [](real x) -> real {
  for (int reach = 1; reach < TEAM; reach *= 2) {
    const real other = __shfl_xor_sync(~0u, x, reach);
    x = x > other ? x : other;
  }
  return x;
};
// adds what the other chain has of the same column
auto join_chains = [&](real (&column)[1][DOFS]) {
  const int other = member < 2 * (DOFS + 1) ? (member + DOFS + 1) % (2 * (DOFS + 1)) : member;
  UNROLL for (int m = 0; m < DOFS; ++m) column[0][m] += __shfl_sync(~0u, column[0][m], other);
};
#else
typedef scalar real __attribute__((vector_size(sizeof(scalar) * WIDTH)));
#define TEAM 1
#define MEET (SECTIONS - 1)
#define COLUMNS (DOFS + 1)
#define REUSES_FACTORS true
const int sling = tid, member = 0, first_of_chain = 0, first_column = 0;
const bool backwards = false;
#define OF_SLING(array, size) ((real*)array.data + (size_t)sling * (size))
#define LOWER_PART_FROM(column) (column)
#define ENTRY(columns, column, row) columns[column][row]
#define ROW_OF_OWN(columns, row, q) columns[row][q]       // by symmetry
#define OF_COLUMN(values, column) values[column]
#define WAIT_FOR_TEAM
auto all_lanes = [](auto mask) -> bool { bool all = true; for (int k = 0; k < WIDTH; ++k) all &= (mask[k] != 0); return all; };
auto root = [](real x) -> real { real y; for (int k = 0; k < WIDTH; ++k) y[k] = __builtin_sqrt(x[k]); return y; };
#define ALL(mask) all_lanes(mask)
#define SQRT(x) root(x)
#define UNROLL _Pragma("clang loop unroll(full)")
#define INLINED __attribute__((always_inline))            // else what the lambda captures lies in memory
auto team_maximum = [](real x) -> real { return x; };
auto join_chains = [](real (&)[COLUMNS][DOFS]) {};
#endif

const real zero = real() * (scalar)0, one = zero + (scalar)1;
auto maximum = [](real x, real y) -> real { return x > y ? x : y; };
auto minimum = [](real x, real y) -> real { return x < y ? x : y; };
auto magnitude = [&](real x) -> real { return x < zero ? -x : x; };
auto dot = [](const real* x, const real* y) -> real { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; };
auto cross = [](const real* x, const real* y, real* z) {
  z[0] = x[1] * y[2] - x[2] * y[1]; z[1] = x[2] * y[0] - x[0] * y[2]; z[2] = x[0] * y[1] - x[1] * y[0]; };
