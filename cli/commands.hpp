// The subcommands of `rotorloop`, one file each: add_NAME() declares options and help, its callback runs the command and
// leaves the exit code. Errors travel as rotorloop::Error to main().
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

void add_airframe(CLI::App& app, int& exit_code);
void add_bus(CLI::App& app, int& exit_code);  // the group; cli/bus
void add_calibrate(CLI::App& app, int& exit_code);
void add_close(CLI::App& app, int& exit_code);
void add_controller(CLI::App& app, int& exit_code);
void add_diagnose(CLI::App& app, int& exit_code);
void add_esc(CLI::App& app, int& exit_code);  // the group; cli/esc
void add_esc_lab(CLI::App& app, int& exit_code);
void add_esc_sim(CLI::App& app, int& exit_code);
void add_fly(CLI::App& app, int& exit_code);
void add_gains(CLI::App& app, int& exit_code);
void add_identify(CLI::App& app, int& exit_code);
void add_image(CLI::App& app, int& exit_code);  // the group; cli/image
void add_log(CLI::App& app, int& exit_code);
void add_mcu(CLI::App& app, int& exit_code);    // the group; cli/mcu
void add_rotor(CLI::App& app, int& exit_code);  // the group; its commands add themselves below it:
void add_rotor_plot(CLI::App& rotor_group, int& exit_code);
void add_rotor_validate(CLI::App& rotor_group, int& exit_code);
void add_rotor_fit(CLI::App& rotor_group, int& exit_code);
void add_rotor_polar(CLI::App& rotor_group, int& exit_code);
void add_rotor_bench(CLI::App& rotor_group, int& exit_code);
void add_stand(CLI::App& app, int& exit_code);  // the group; its commands add themselves below it:
void add_stand_estimate(CLI::App& stand_group, int& exit_code);
void add_stand_compare(CLI::App& stand_group, int& exit_code);
void add_trajectory(CLI::App& app, int& exit_code);
void add_vehicle(CLI::App& app, int& exit_code);

}  // namespace rotorloop::cli
