// The first process of the guest: loads the modules that were packed, mounts the host's tree read-only, runs the one command there, and
// tells QEMU its exit status through the debug port. Static, as nothing else is in the initramfs. Whatever fails ends the guest without a
// verdict.
#include <fcntl.h>
#include <sys/io.h>
#include <sys/mount.h>
#include <sys/reboot.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr unsigned short kVerdictPort = 0xF4;  // isa-debug-exit: QEMU ends with status 2 * byte + 1

[[noreturn]] void end_without_verdict(const std::string& what) {
  std::printf("guest: %s: %s\n", what.c_str(), std::strerror(errno));
  std::fflush(stdout);
  ::sync();
  ::reboot(RB_POWER_OFF);
  ::_exit(1);
}

void mount_at(const char* source, const char* target, const char* type, unsigned long flags = 0, const char* data = nullptr) {
  ::mkdir(target, 0755);
  if (::mount(source, target, type, flags, data) != 0) end_without_verdict(std::string("cannot mount ") + target);
}

// "/modules/order" has a line "FILE [PARAMETER=VALUE]…" for each, those that others need before them.
void load_modules() {
  std::ifstream order("/modules/order");
  for (std::string line; std::getline(order, line);) {
    const std::size_t blank = std::min(line.find(' '), line.size());
    const std::string file = "/modules/" + line.substr(0, blank), parameters = line.substr(std::min(blank + 1, line.size()));
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0 || ::syscall(SYS_finit_module, descriptor, parameters.c_str(), 0) != 0) end_without_verdict("cannot load " + file);
    ::close(descriptor);
  }
}

// Words of a file, each ended by a zero byte.
std::vector<std::string> words(const char* path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<std::string> all;
  for (std::string word; std::getline(in, word, '\0');) all.push_back(word);
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

int run() {
  std::vector<std::string> command = words("/command"), environment = words("/environment");
  const pid_t child = ::fork();
  if (child == 0) {
    if (::chroot("/host") != 0 || ::chdir("/tmp") != 0) end_without_verdict("cannot enter the host's tree");
    const auto arguments = pointers(command), variables = pointers(environment);
    ::execve(arguments[0], arguments.data(), variables.data());
    std::printf("guest: cannot run %s: %s\n", arguments[0], std::strerror(errno));
    std::fflush(stdout);
    ::_exit(99);
  }
  int status = 0;
  for (pid_t ended = 0; ended != child;) ended = ::wait(&status);  // orphans too
  return WIFEXITED(status) ? WEXITSTATUS(status) : 96;
}

}  // namespace

int main() {
  mount_at("proc", "/proc", "proc");
  mount_at("sysfs", "/sys", "sysfs");
  load_modules();
  mount_at("host", "/host", "9p", MS_RDONLY, "trans=virtio,version=9p2000.L,msize=262144,cache=loose");
  mount_at("devtmpfs", "/host/dev", "devtmpfs");
  mount_at("proc", "/host/proc", "proc");
  mount_at("sysfs", "/host/sys", "sysfs");
  mount_at("tmpfs", "/host/tmp", "tmpfs", 0, "mode=1777");
  const int status = run();
  std::fflush(stdout);
  if (::ioperm(kVerdictPort, 1, 1) != 0) end_without_verdict("the port of the verdict is refused");
  outb(static_cast<unsigned char>(status), kVerdictPort);
  end_without_verdict("QEMU did not take the verdict");
}
