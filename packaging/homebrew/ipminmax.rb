# brew install --build-from-source packaging/homebrew/ipminmax.rb, after cmake --build build/release --target dist.
# A tap has the URL and sha256 of a release.
class Ipminmax < Formula
  desc "Interior-point solver for constrained nonconvex-nonconcave minmax problems"
  homepage "https://example.org/ipminmax"
  url "file://#{File.expand_path("../../build/release/ipminmax-0.3.0.tar.gz", __dir__)}"
  license "BSD-3-Clause"

  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "pkgconf" => [:build, :test]
  depends_on "ampl-asl"
  depends_on "eigen"
  depends_on "ipopt"
  depends_on "metis"
  depends_on "mumps"
  depends_on "openblas"

  def install
    args = %W[
      -DIPMINMAX_BUILD_TESTS=OFF
      -DIPMINMAX_BUILD_EXAMPLES=OFF
      -DIPMINMAX_BUILD_PYTHON=OFF
      -DIPMINMAX_BUILD_CASADI=OFF
      -DIPMINMAX_MPI=OFF
      -DIPOPT_ROOT=#{Formula["ipopt"].opt_prefix}
      -DMUMPS_ROOT=#{Formula["mumps"].opt_prefix}
      -DBLA_VENDOR=OpenBLAS
    ]
    system "cmake", "-S", ".", "-B", "build", "-G", "Ninja", *args, *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
    pkgshare.install "tests/package/saddle.nl"
  end

  test do
    output = shell_output("#{bin}/ipminmax #{pkgshare}/saddle.nl")
    assert_match "certified local minmax", output
  end
end
