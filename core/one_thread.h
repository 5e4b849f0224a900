#pragma once
// OpenMP's threads, of which some libraries start as many as there are processors.

namespace rugae {

/// As long as it lives, OpenMP works in the calling thread alone, whatever number of threads a
/// library asks for (Open3D does, so that a limit to their number would not do). The setting is one
/// of each calling thread (max-active-levels-var; OpenMP 5.0, sections 2.5 and 2.6.1), and is put
/// back.
class OneOpenMpThread {
 public:
  OneOpenMpThread();
  ~OneOpenMpThread();
  OneOpenMpThread(const OneOpenMpThread&) = delete;
  OneOpenMpThread& operator=(const OneOpenMpThread&) = delete;

 private:
  int levels_before_;
};

}  // namespace rugae
