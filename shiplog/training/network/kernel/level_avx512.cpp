// Processors with AVX-512.
#include <algorithm>
#include <cmath>

#include "interface.h"
#include "memory.h"

#if defined(__x86_64__)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl,avx512bw,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512vl,avx512bw,fma")
#endif

#define LANE_BYTES 64
#define ROWS 8

namespace shiplog {
namespace avx512 {
#include "products.h"
#include "rollouts.h"
}  // namespace avx512
const Level avx512_level = {"AVX-512", avx512::rollouts<float>, avx512::rollouts<double>, avx512::adam<float>,
                          avx512::adam<double>};
}  // namespace shiplog

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
