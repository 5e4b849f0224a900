// The command line: arguments -> options -> one call a subcommand. Errors are one line on standard
// error. Exit codes: 0 done, 1 a fault of ours, 2 bad usage or input, 3 a gate or a cell failed,
// 130 stopped by Ctrl-C.

#include <glog/logging.h>
#include <malloc.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>

#include "apps/commands.h"
#include "core/check.h"
#include "core/progress.h"

namespace {

constexpr int kFault = 1, kBadInput = 2, kInterrupted = 130;

int said(int code, const char* text) {
  std::fprintf(stderr, "rugae: %s\n", text);
  return code;
}

// Frames come and go by the dozen megabytes: their memory is kept for the next ones, not handed
// back to the system, which would clear every page of it again.
void keep_memory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the most that glibc takes
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
}

}  // namespace

int main(int argc, char** argv) {
  keep_memory();
  FLAGS_minloglevel = google::GLOG_ERROR;  // of Ceres: a step that it tries again is no news
  CLI::App app{"rugae: a capsule endoscope in a stomach, simulated, reconstructed and measured"};
  app.set_version_flag("--version", RUGAE_VERSION);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::simple);
  app.footer(
      "Exit codes: 0 done, 1 a fault of ours, 2 bad usage or input, 3 a gate or a cell failed, 130 "
      "stopped by Ctrl-C.");
  int exit_code = 0;
  rugae::add_simulate(app);
  rugae::add_calibrate(app);
  rugae::add_reconstruct(app);
  rugae::add_evaluate(app);
  rugae::add_run(app, exit_code);
  rugae::add_check(app, exit_code);
  rugae::add_picture(app);
  rugae::add_export(app);
  rugae::add_list(app);
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& shown) {  // --help, --version
    return app.exit(shown);
  } catch (const CLI::ParseError& error) {
    return said(kBadInput, rugae::usage_error(app, argc, argv, error).c_str());
  } catch (const rugae::Interrupted& stop) {
    const bool goes_on =
        app.got_subcommand("simulate") || app.got_subcommand("run") || app.got_subcommand("export");
    return said(kInterrupted,
                (std::string(stop.what()) + (goes_on ? "; the same command goes on from here"
                                                     : "; the same command begins anew"))
                    .c_str());
  } catch (const rugae::Error& error) {
    return said(kBadInput, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return said(kBadInput, error.what());
  } catch (const std::bad_alloc&) {
    return said(kFault, "out of memory");
  } catch (const std::exception& error) {
    return said(kFault, (std::string("internal fault: ") + error.what()).c_str());
  }
}
