#pragma once

#include <cstdio>
#include <exception>
#include <ipminmax/core/result.hpp>
#include <string>

/// What a result is, in words; returns the program's exit status.
inline int report(const ipminmax::Result& result) {
  const ipminmax::Certificate& c = result.certificate;
  std::printf("status       %s\n", std::string(name_of(result.status)).c_str());
  std::printf("point        %s (second-order test: %s)\n", std::string(name_of(c.kind)).c_str(),
              std::string(name_of(c.second_order)).c_str());
  std::printf("objective    %.10g after %d iterations\n", result.objective, result.iterations);
  const auto print = [](const char* name, const ipminmax::Inertia& found,
                        const ipminmax::Inertia& expected) {
    std::printf("  %-5s found (%d+, %d-, %d zero), expected (%d+, %d-, %d zero)\n", name,
                found.positive, found.negative, found.zero, expected.positive, expected.negative,
                expected.zero);
  };
  if (c.second_order != ipminmax::SecondOrder::NotTested) {
    print("K_yy", c.inner, c.inner_expected);
    print("K", c.full, c.full_expected);
  }
  return c.kind == ipminmax::PointKind::LocalMinmax ? 0 : 1;
}

/// main of an example: runs it and prints what goes wrong.
template <class Run>
int guarded(const char* name, Run run) {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 2;
  }
}
