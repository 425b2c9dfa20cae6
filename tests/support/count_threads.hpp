#pragma once

#include <dirent.h>
#include <unistd.h>

namespace ipminmax::testing {

inline int threads_of_this_process() {
  int count = 0;
  DIR* tasks = opendir("/proc/self/task");
  if (tasks == nullptr) return 0;
  while (const dirent* entry = readdir(tasks)) {
    if (entry->d_name[0] != '.') ++count;
  }
  closedir(tasks);
  return count;
}

/// Whether there are so many, in a second at most: a thread that is joined may still be listed.
inline bool has_threads(int count) {
  for (int k = 0; k < 1000 && threads_of_this_process() != count; ++k) usleep(1000);
  return threads_of_this_process() == count;
}

}  // namespace ipminmax::testing
