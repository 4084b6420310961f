// SPDX-License-Identifier: Apache-2.0
using UnityEngine;
#if STEREOCELL_CARDBOARD
using Google.XR.Cardboard;
#endif

namespace StereoCell.Samples
{
    /// <summary>
    /// The button of the Cardboard viewer switches the tile that is looked at, without waiting for the dwell. Without the
    /// Cardboard XR plug-in, a mouse click or a tap does the same.
    /// </summary>
    [RequireComponent(typeof(GazeSwitch)), AddComponentMenu("StereoCell/Cardboard Button")]
    public sealed class CardboardButton : MonoBehaviour
    {
        void Start()
        {
            Screen.sleepTimeout = SleepTimeout.NeverSleep;  // the screen is not touched during use
#if STEREOCELL_CARDBOARD && !UNITY_EDITOR
            if (!Api.HasDeviceParams()) Api.ScanDeviceParams();
#endif
        }

        void Update()
        {
#if STEREOCELL_CARDBOARD && !UNITY_EDITOR
            if (Api.IsGearButtonPressed) Api.ScanDeviceParams();
            if (Api.IsCloseButtonPressed) Application.Quit();
            if (Api.HasNewDeviceParams()) Api.ReloadDeviceParams();
#endif
            if (IsPressed()) GetComponent<GazeSwitch>().Press();
        }

        static bool IsPressed()
        {
#if STEREOCELL_CARDBOARD && !UNITY_EDITOR
            return Api.IsTriggerPressed;
#elif ENABLE_LEGACY_INPUT_MANAGER
            return Input.GetMouseButtonDown(0);
#else
            return false;
#endif
        }
    }
}
