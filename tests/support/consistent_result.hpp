#pragma once

#include <gtest/gtest.h>

#include <core/result.hpp>

namespace ipminmax::testing {

/// That the statements of a result do not contradict each other.
inline void expect_consistent(const Result& result) {
  const bool success = is_success(result.status);
  const SearchOverY& y = result.over_y;
  const SearchOverX& x = result.over_x;
  if (result.certificate.kind == PointKind::LocalMinmax) {
    EXPECT_TRUE(success) << "certified, but " << result.message;
  }
  if (success) {
    EXPECT_TRUE(y.finished) << result.message;
    EXPECT_FALSE(y.better_known) << result.message;
    EXPECT_EQ(x.made, x.asked) << result.message;
    EXPECT_FALSE(result.v.empty());
  }
  if (result.worst_case.starts > 0 && result.worst_case.higher) {
    EXPECT_FALSE(success) << "another y is higher, but " << result.message;
  }
  EXPECT_LE(x.made, x.asked);
}

}  // namespace ipminmax::testing
