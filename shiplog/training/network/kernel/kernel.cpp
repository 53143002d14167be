// The C interface of the kernel, and which instruction set it runs on.

#include "interface.h"
#include "memory.h"

#include <algorithm>
#include <exception>
#include <system_error>

namespace shiplog {

Pool& pool() {
  static Pool* one = new Pool;  // never destroyed: threads may still give back at exit
  return *one;
}

void in_parallel(int64_t count, int threads, const std::function<void(int64_t)>& work) {
  const int64_t used = std::min<int64_t>(count, threads);
  std::vector<std::exception_ptr> failed(static_cast<size_t>(count));
  const auto some = [&](int64_t from) {
    for (int64_t i = from; i < count; i += used) try {
        work(i);
      } catch (...) {
        failed[size_t(i)] = std::current_exception();
      }
  };
  std::vector<std::thread> others;
  std::vector<int64_t> own = {0};
  for (int64_t t = 1; t < used; ++t) try {
      others.emplace_back(some, t);
    } catch (const std::system_error&) {  // no thread to be had: done here
      own.push_back(t);
    }
  for (const int64_t t : own) some(t);
  for (auto& other : others) other.join();
  for (const auto& one : failed)
    if (one) std::rethrow_exception(one);
}

namespace {

const Level* level(int number) {
  switch (number) {
#if defined(__x86_64__)
    case 2: return &avx512_level;
    case 1: return &avx2_level;
#endif
    default: return &portable_level;
  }
}

template <class Call> double guarded(const Call& call) {
  try {
    return call();
  } catch (const std::bad_alloc&) {
    return -1.0;  // a loss is never negative
  }
}

}  // namespace
}  // namespace shiplog

using namespace shiplog;

extern "C" {

// The highest level that this processor runs: 0 portable, 1 AVX2, 2 AVX-512.
int shiplog_level() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    return 2;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return 1;
#endif
  return 0;
}

const char* shiplog_level_name(int number) { return level(number)->name; }

// The loss; -1 where there is too little memory.
double shiplog_rollouts_f32(int number, const Network<float>* net, const Windows<float>* data,
                            float* const* gradients, int threads) {
  return guarded(
      [&] { return level(number)->rollouts_f32(*net, *data, gradients, threads); });
}
double shiplog_rollouts_f64(int number, const Network<double>* net, const Windows<double>* data,
                            double* const* gradients, int threads) {
  return guarded(
      [&] { return level(number)->rollouts_f64(*net, *data, gradients, threads); });
}

void shiplog_adam_f32(int number, float* weight, float* mean, float* square, const float* gradient,
                      int64_t size, int64_t step, double rate, double decay) {
  level(number)->adam_f32(weight, mean, square, gradient, size, step, rate, decay);
}
void shiplog_adam_f64(int number, double* weight, double* mean, double* square,
                      const double* gradient, int64_t size, int64_t step, double rate,
                      double decay) {
  level(number)->adam_f64(weight, mean, square, gradient, size, step, rate, decay);
}
}
