#pragma once

#include <string>

namespace ipminmax {

/// Bytes that the process can still take: the least of what RLIMIT_AS, the memory limit of its
/// control group (Linux; also those of the groups above) and max_process_bytes, compared with the
/// resident memory, leave. Infinite where there is no limit. Reads files of /proc and /sys.
[[nodiscard]] double available_memory(double max_process_bytes);

/// Bytes that the memory limits of control groups leave: those of the groups that groups_file lists
/// (as /proc/self/cgroup) and of all above them; infinite without a limit, negative beyond one.
/// Pages of files that nobody uses count as free. root: where the groups are mounted, version 2 or,
/// in root/memory, version 1. Inside a container the path of the own group may not exist; its root
/// then is the group.
[[nodiscard]] double left_in_control_groups(const std::string& groups_file,
                                            const std::string& root);

/// Whether OpenBLAS, or another BLAS, has its work buffer. OpenBLAS maps it at its first call and
/// tries for ever when it cannot: where the address space is limited this reserves so much, and
/// makes that call. To be asked before anything that calls BLAS; the answer yes is final.
[[nodiscard]] bool blas_has_memory();

}  // namespace ipminmax
