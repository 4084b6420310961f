// Stub of UnityEngine's modules that the package uses: application, input, web requests, XR and curves.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;

namespace UnityEngine
{
    public delegate void UnityAction();  // in UnityEngine.Events in Unity

    public class Debug
    {
        public static readonly List<string> Errors = new List<string>();  // only in the stub
        public static void LogError(object message, Object context) { Errors.Add((string)message); }
    }

    public class Application
    {
        public static bool isPlaying { get; set; }
        public static string streamingAssetsPath { get; set; }
        public static string temporaryCachePath { get; set; }
        public static event UnityAction onBeforeRender { add { } remove { } }
        public static void Quit() { }
    }

    public sealed class Screen { public static int sleepTimeout { get; set; } }
    public static class SleepTimeout { public const int NeverSleep = -1; }

    public class Input
    {
        public static bool Pressed;  // only in the stub
        public static bool GetMouseButtonDown(int button) { return Pressed && button == 0; }
    }

    public struct Hash128
    {
        string text;
        public static Hash128 Compute(string data) { return new Hash128 { text = data }; }
        public override bool Equals(object other) { return other is Hash128 && ((Hash128)other).text == text; }
        public override int GetHashCode() { return text == null ? 0 : text.GetHashCode(); }
    }

    public struct Keyframe
    {
        public float time { get; set; }
        public float value { get; set; }
        public float inTangent { get; set; }
        public float outTangent { get; set; }
        public Keyframe(float time, float value, float inTangent, float outTangent) : this()
        {
            this.time = time;
            this.value = value;
            this.inTangent = inTangent;
            this.outTangent = outTangent;
        }
    }

    /// <summary>A curve of Hermite pieces between keys. An infinite tangent keeps the key's value, as Unity
    /// documents.</summary>
    public class AnimationCurve
    {
        public Keyframe[] keys { get; set; }
        public AnimationCurve(params Keyframe[] keys) { this.keys = keys; }
        public float Evaluate(float time)
        {
            if (time <= keys[0].time) return keys[0].value;
            for (var i = 1; i < keys.Length; i++)
            {
                Keyframe a = keys[i - 1], b = keys[i];
                if (time > b.time) continue;
                if (time == b.time && i + 1 < keys.Length) return keys[i].value;
                double width = b.time - a.time, t = (time - a.time) / width;
                if (float.IsInfinity(a.outTangent) || float.IsInfinity(b.inTangent)) return t < 1 ? a.value : b.value;
                double t2 = t * t, t3 = t2 * t;
                return (float)((2 * t3 - 3 * t2 + 1) * a.value + (t3 - 2 * t2 + t) * width * a.outTangent
                    + (3 * t2 - 2 * t3) * b.value + (t3 - t2) * width * b.inTangent);
            }
            return keys[keys.Length - 1].value;
        }
    }

    public struct GradientColorKey
    {
        public Color color;
        public float time;
        public GradientColorKey(Color col, float time) { color = col; this.time = time; }
    }

    public struct GradientAlphaKey
    {
        public float alpha, time;
        public GradientAlphaKey(float alpha, float time) { this.alpha = alpha; this.time = time; }
    }

    public class Gradient
    {
        public GradientColorKey[] colorKeys { get; set; }
        public GradientAlphaKey[] alphaKeys { get; set; }
        public void SetKeys(GradientColorKey[] colorKeys, GradientAlphaKey[] alphaKeys)
        {
            if (colorKeys.Length > 8 || alphaKeys.Length > 8) throw new ArgumentException("a gradient has 8 keys at most");
            this.colorKeys = colorKeys;
            this.alphaKeys = alphaKeys;
        }
        public Color Evaluate(float time)  // the stub uses only the first colour
        {
            var color = colorKeys[0].color;
            var curve = new AnimationCurve(alphaKeys.Select(key => new Keyframe(key.time, key.alpha, 0, 0)).ToArray());
            var keys = curve.keys;
            for (var i = 0; i + 1 < keys.Length; i++)
            {
                var slope = (keys[i + 1].value - keys[i].value) / (keys[i + 1].time - keys[i].time);
                keys[i].outTangent = slope;
                keys[i + 1].inTangent = slope;
            }
            return new Color(color.r, color.g, color.b, curve.Evaluate(time));
        }
    }

    public class GUILayout
    {
        public static bool Button(string text, params GUILayoutOption[] options) { return false; }
    }
    public sealed class GUILayoutOption { }
    public class ScriptableObject : Object { }
}

namespace UnityEngine.Networking
{
    public class DownloadHandler : IDisposable { public void Dispose() { } }
    public sealed class DownloadHandlerFile : DownloadHandler
    {
        public readonly string Path;  // only in the stub
        public DownloadHandlerFile(string path) { Path = path; }
    }
    public class UploadHandler { }
    public class UnityWebRequestAsyncOperation { }

    /// <summary>Reads Android's addresses jar:file://... as files. A request is done when it is checked for the second
    /// time.</summary>
    public class UnityWebRequest : IDisposable
    {
        public enum Result { InProgress, Success, ConnectionError, ProtocolError, DataProcessingError }
        public const string kHttpVerbGET = "GET";
        readonly DownloadHandlerFile into;
        int looks;
        public UnityWebRequest(string url, string method, DownloadHandler downloadHandler, UploadHandler uploadHandler)
        {
            this.url = url;
            into = (DownloadHandlerFile)downloadHandler;
        }
        public string url { get; set; }
        public string error { get; private set; }
        public Result result { get; private set; }
        public bool isDone { get { return ++looks > 1; } }
        public UnityWebRequestAsyncOperation SendWebRequest()
        {
            var path = url.Replace("jar:file://", "");
            result = File.Exists(path) ? Result.Success : Result.ProtocolError;
            if (result == Result.Success) File.Copy(path, into.Path);
            else error = "404";
            return new UnityWebRequestAsyncOperation();
        }
        public void Dispose() { }
    }
}

namespace UnityEngine.XR
{
    public enum XRNode { LeftEye, RightEye, CenterEye, Head }
    public struct InputFeatureUsage<T> { }
    public static class CommonUsages
    {
        public static InputFeatureUsage<Vector3> centerEyePosition;
        public static InputFeatureUsage<Quaternion> centerEyeRotation;
    }
    public struct InputDevice
    {
        public bool isValid { get { return false; } }
        public bool TryGetFeatureValue(InputFeatureUsage<Vector3> usage, out Vector3 value) { value = new Vector3(); return false; }
        public bool TryGetFeatureValue(InputFeatureUsage<Quaternion> usage, out Quaternion value) { value = new Quaternion(); return false; }
    }
    public class InputDevices
    {
        public static InputDevice GetDeviceAtXRNode(XRNode node) { return new InputDevice(); }
    }
}
