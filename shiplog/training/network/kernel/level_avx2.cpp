// Processors with AVX2.
#include <algorithm>
#include <cmath>

#include "interface.h"
#include "memory.h"

#if defined(__x86_64__)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif

#define LANE_BYTES 32
#define ROWS 6

namespace shiplog {
namespace avx2 {
#include "products.h"
#include "rollouts.h"
}  // namespace avx2
const Level avx2_level = {"AVX2", avx2::rollouts<float>, avx2::rollouts<double>, avx2::adam<float>,
                          avx2::adam<double>};
}  // namespace shiplog

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
