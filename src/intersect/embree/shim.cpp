// Commits an Embree scene with a bound on the threads that build it.
//
// Embree's own `threads=` installs a process-wide limit on TBB and would slow down the host
// (embree#507); a task arena bounds this build alone. No exception and no C++ type leaves this file.

#include <embree4/rtcore.h>
#include <tbb/task_arena.h>

#include <cstddef>
#include <cstdio>
#include <exception>

// 0 on success; Embree's own errors go to the device's error function. Otherwise 1, and `message`
// holds at most `size` bytes, terminating zero included.
extern "C" int caustica_embree_commit(RTCScene scene, int threads, char* message, std::size_t size) noexcept {
  try {
    if (threads < 1) threads = 1;
    tbb::task_arena arena(threads);
    arena.execute([&] { rtcCommitScene(scene); });
    return 0;
  } catch (const std::exception& e) {
    if (message && size) std::snprintf(message, size, "%s", e.what());
    return 1;
  } catch (...) {
    if (message && size) std::snprintf(message, size, "unknown C++ exception");
    return 1;
  }
}
