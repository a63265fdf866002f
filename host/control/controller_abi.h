/* A controller of your own as a shared library: rotorloop hil SCENARIO --controller ./my_controller.so (docs/controller.md).
   Plain C data and one factory. SI units. W: world, x-forward, y-left, z-up at the flight's start; B: body, x-forward, y-left,
   z-up, origin at the centre of mass; S: pose sensor. Quaternions w, x, y, z; q_WB turns B into W. Rotors 1 front-right,
   2 rear-left, 3 front-left, 4 rear-right; 1 and 2 give -z reaction torque, 3 and 4 +z. */
#ifndef ROTORLOOP_CONTROLLER_ABI_H
#define ROTORLOOP_CONTROLLER_ABI_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ROTORLOOP_CONTROLLER_ABI 1u

/* What a controller commands. */
#define ROTORLOOP_LEVEL_POSITION 1u    /* set-point of our position loop: p_W_m, v_W_m_s, a_W_m_s2, j_W_m_s3, yaw_rad, yaw_rate_rad_s */
#define ROTORLOOP_LEVEL_ATTITUDE 2u    /* set-point of our attitude loop: q_WB, w_B_rad_s, thrust_N */
#define ROTORLOOP_LEVEL_ROTOR_SPEED 3u /* four speeds: omega_rad_s */

#define ROTORLOOP_PHASE_BOOT 0u    /* ESCs and estimator start; no rotor turns */
#define ROTORLOOP_PHASE_SPIN_UP 1u /* armed, idle speed, airframe held on the launch stand */
#define ROTORLOOP_PHASE_FLYING 2u  /* the controller has the rotors; the stand lets go 0.3 s after this began */
#define ROTORLOOP_PHASE_SAFE 3u    /* disarmed for good */

typedef struct {
  uint32_t size; /* of this structure as the runner knows it */
  uint32_t abi;
  double period_s; /* of step() */
  double mass_kg;  /* of the vehicle file, as are the speeds of the next lines */
  double hover_omega_rad_s, omega_min_rad_s, omega_max_rad_s;
  const char* vehicle_file; /* valid during create() alone, as are the next ones */
  const char* gains_file;
  const char* flight;     /* name */
  const char* log_folder; /* where files of the controller may go; empty: no logs are kept */
} rotorloop_controller_setup;

typedef struct {
  uint32_t size;
  uint32_t phase;
  uint64_t step; /* counts control steps from 0 */
  double t_s;    /* of the IMU sample, airframe clock */
  double gyro_B_rad_s[3];
  double accel_B_m_s2[3]; /* specific force: +9.81 on z at rest */
  uint32_t pose_new;      /* 1: a pose arrived since the step before; 0: pose_* are not a number */
  uint32_t estimate_valid;
  double pose_t_s;                                     /* when it was measured; it arrives 12 to 18 ms later */
  double pose_p_W_m[3], pose_q_WS[4], pose_v_W_m_s[3]; /* of the sensor, not of the centre of mass */
  double estimate_p_W_m[3], estimate_v_W_m_s[3], estimate_q_WB[4], estimate_w_B_rad_s[3];    /* ours, of the centre of mass */
  double setpoint_p_W_m[3], setpoint_v_W_m_s[3], setpoint_a_W_m_s2[3], setpoint_j_W_m_s3[3]; /* of the trajectory */
  double setpoint_yaw_rad, setpoint_yaw_rate_rad_s;
  double omega_rad_s[4]; /* newest feedback; not a number: unknown */
  double bus_V;
} rotorloop_controller_input;

/* The runner fills it before each step(): what has to be given with not-a-number, everything else with 0. */
typedef struct {
  uint32_t size;
  uint32_t limiters; /* for the log: 1 tilt, 2 thrust, 4 roll_pitch, 8 yaw, 16 table_edge, 32 direction_held */
  double p_W_m[3], v_W_m_s[3], a_W_m_s2[3], j_W_m_s3[3], yaw_rad, yaw_rate_rad_s; /* position: p_W_m and yaw_rad are needed */
  double q_WB[4], w_B_rad_s[3], thrust_N; /* attitude: q_WB and thrust_N are needed; w_B_rad_s in the axes of q_WB */
  double omega_rad_s[4];                  /* rotor speed: all are needed */
  double estimate_p_W_m[3], estimate_v_W_m_s[3], estimate_q_WB[4], estimate_w_B_rad_s[3]; /* needed with own_estimate */
  double torque_B_N_m[3]; /* for the log, at rotor-speed level, as are q_WB and thrust_N there */
} rotorloop_controller_output;

typedef struct {
  uint32_t abi;                                 /* ROTORLOOP_CONTROLLER_ABI */
  uint32_t setup_size, input_size, output_size; /* sizeof of the three structures above */
  uint32_t level;                               /* ROTORLOOP_LEVEL_… */
  uint32_t every;                               /* asked at every n-th control step, 1 to 100; the last answer holds in between */
  uint32_t own_estimate;                        /* 1: our loops and the log use estimate_* of the output */
  uint32_t reserved;                            /* 0 */
  double start_s;                               /* earliest start of the trajectory after power-on; 0: as soon as the vehicle is ready */
  void* (*create)(const rotorloop_controller_setup*); /* a controller for one flight; null: it cannot fly (say why on stderr) */
  void (*step)(void* controller, const rotorloop_controller_input*, rotorloop_controller_output*);
  void (*destroy)(void* controller);
} rotorloop_controller;

/* The one symbol that the library exports. What it returns lives as long as the library. */
const rotorloop_controller* rotorloop_controller_factory(void);

#ifdef __cplusplus
}
#endif
#endif
