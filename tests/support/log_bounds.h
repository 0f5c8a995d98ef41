#pragma once

// Logs the worst value and the limit of each comparison of floating-point numbers. The script
// tests/loose_bounds.py compiles the tests with this header as a forced include. Normal builds do
// not use it.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <type_traits>

namespace log_bounds {

/// Evaluations of one assertion.
struct Statistics {
  long count = 0;
  double worst = 0;     ///< largest magnitude compared
  double tightest = 0;  ///< largest magnitude over its limit
};

/// Statistics of all assertions, appended to the file named by LEVELSMITH_BOUNDS_LOG at exit.
class Log {
 public:
  static Log& instance() {
    static Log log;
    return log;
  }

  void add(const char* kind, const char* file, int line, double value, double limit) {
    const std::lock_guard<std::mutex> lock(mutex_);
    Statistics& s = all_[{file, line, kind}];
    ++s.count;
    s.worst = std::max(s.worst, std::abs(value));
    if (limit != 0) s.tightest = std::max(s.tightest, std::abs(value / limit));
  }

 private:
  Log() = default;
  ~Log() {
    const char* path = std::getenv("LEVELSMITH_BOUNDS_LOG");
    if (!path || getpid() != process_) return;  // a death test's child has partial statistics
    std::FILE* out = std::fopen(path, "a");
    if (!out) return;
    for (const auto& [key, s] : all_)
      std::fprintf(out, "%s|%d|%s|%ld|%.9g|%.9g\n", std::get<0>(key).c_str(), std::get<1>(key),
                   std::get<2>(key).c_str(), s.count, s.worst, s.tightest);
    std::fclose(out);
  }

  std::mutex mutex_;
  std::map<std::tuple<std::string, int, std::string>, Statistics> all_;
  pid_t process_ = getpid();
};

template <typename A, typename B>
void add(const char* kind, const char* file, int line, const A& value, const B& limit) {
  if constexpr (std::is_arithmetic_v<A> && std::is_arithmetic_v<B> &&
                (std::is_floating_point_v<A> || std::is_floating_point_v<B>))
    Log::instance().add(kind, file, line, static_cast<double>(value), static_cast<double>(limit));
}

}  // namespace log_bounds

#undef EXPECT_LT
#undef EXPECT_LE
#undef EXPECT_NEAR
#undef ASSERT_LT
#undef ASSERT_LE
#undef ASSERT_NEAR
#define LOG_BOUNDS_COMPARE(kind, assertion, value, limit)                     \
  assertion(([](const char* a, const char* b, const auto& v, const auto& l) { \
              log_bounds::add(#kind, __FILE__, __LINE__, v, l);               \
              return ::testing::internal::CmpHelper##kind(a, b, v, l);        \
            }),                                                               \
            value, limit)
#define LOG_BOUNDS_NEAR(assertion, value, expected, limit)                                   \
  assertion(([](const char* a, const char* b, const char* c, double v, double e, double l) { \
              log_bounds::add("NEAR", __FILE__, __LINE__, v - e, l);                         \
              return ::testing::internal::DoubleNearPredFormat(a, b, c, v, e, l);            \
            }),                                                                              \
            value, expected, limit)
#define EXPECT_LT(value, limit) LOG_BOUNDS_COMPARE(LT, EXPECT_PRED_FORMAT2, value, limit)
#define EXPECT_LE(value, limit) LOG_BOUNDS_COMPARE(LE, EXPECT_PRED_FORMAT2, value, limit)
#define ASSERT_LT(value, limit) LOG_BOUNDS_COMPARE(LT, ASSERT_PRED_FORMAT2, value, limit)
#define ASSERT_LE(value, limit) LOG_BOUNDS_COMPARE(LE, ASSERT_PRED_FORMAT2, value, limit)
#define EXPECT_NEAR(value, expected, limit) \
  LOG_BOUNDS_NEAR(EXPECT_PRED_FORMAT3, value, expected, limit)
#define ASSERT_NEAR(value, expected, limit) \
  LOG_BOUNDS_NEAR(ASSERT_PRED_FORMAT3, value, expected, limit)
